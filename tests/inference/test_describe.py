"""Descriptions tell apart what differs, the same in every process."""

import subprocess
import sys
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.describe import describe
from numpyro.distributions.transforms import AffineTransform

from bolfi_liquids import inference


@dataclass(frozen=True)
class Filter:
    width: float
    weights: np.ndarray


class Plain:
    pass


SAID = [
    (None, "None"),
    ("log", "'log'"),
    (np.float64(0.5), "0.5"),
    (np.linalg.norm, "numpy.linalg.norm"),
    (partial(np.mean, axis=0), "partial(numpy.mean, [], axis=0)"),
    (inference.surrogates.Quantile(0.1), "bolfi_liquids.Quantile(q=0.1)"),
    (inference.Prior({"a": dist.Uniform(0.0, 2.0)}), "Prior(a=Uniform(low=0, high=2))"),
]


def test_says_what_it_is_and_no_address():
    assert [describe(value) for value, _ in SAID] == [text for _, text in SAID]
    shifted = dist.TransformedDistribution(dist.Normal(0.0, 1.0), AffineTransform(0.5, 2.0))
    inference.Prior({"a": shifted})  # uses the transform's inverse, to which it then refers
    text = "TransformedDistribution(Normal(loc=0, scale=1), AffineTransform(loc=0.5, scale=2.0))"
    assert describe(shifted) == text
    assert "0x" not in describe(Plain()) + describe(lambda x: x)


class Model:
    def __init__(self, size):
        self.size = size

    def __repr__(self):
        return f"Model({self.size})"

    def run(self, theta, seeds):
        return self.size


def test_what_differs_reads_differently():
    pairs = [
        (Model(0.1).run, Model(9.0).run),
        (inference.squared_difference([0, 1, 2]), inference.squared_difference([0, 5, 6])),
        [dist.TruncatedNormal(*by, low=-1.0, high=1.0) for by in ((0.0, 1.0), (0.9, 0.05))],
        [
            dist.TransformedDistribution(dist.Normal(0.0, 1.0), AffineTransform(by, 2.0))
            for by in (0.0, 1.0)
        ],
    ]
    assert [one for one, other in pairs if describe(one) == describe(other)] == []


def test_large_arrays_are_told_apart_in_few_words():
    """NumPy elides what is in the middle."""
    zeros = np.zeros((40, 100))
    other = zeros.copy()
    other[20, 50] = 1.0
    texts = {describe(array) for array in (zeros, other, zeros.astype(int), zeros.T)}
    assert len(texts) == 4 and max(map(len, texts)) < 60
    assert describe(Filter(1.0, zeros)) != describe(Filter(1.0, other))


@pytest.mark.slow
def test_another_process_says_the_same():
    code = (
        "import numpy as np, numpyro.distributions as dist; from bolfi_liquids import inference;"
        "prior = inference.Prior({'a': dist.Uniform(0.0, 1.0)});"
        "print(inference.Bolfi(prior, np.zeros(30), summary=np.sort,"
        " noise=np.arange(30.0)).settings)"
    )
    run = partial(subprocess.run, [sys.executable, "-c", code], capture_output=True, text=True)
    first = run(check=True).stdout
    assert "'summary': 'numpy.sort'" in first and "array(float64, (30,)" in first
    assert run(check=True).stdout == first
