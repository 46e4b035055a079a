"""Arguments of a criticism are refused by their names, before anything is simulated."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism

from bolfi_liquids import inference

NOISE = criticism.KnownNoise(0.01)
OBSERVED = np.linspace(0.0, 1.0, 30)


def refuse(theta, seeds):
    raise AssertionError("it was called")


GOOD = {
    "experiment": criticism.Experiment(refuse, OBSERVED, NOISE),
    "prior": inference.Prior({"a": dist.Uniform(0.0, 1.0)}),
    "extensions": {"drift": criticism.Extension(dist.HalfNormal(1.0))},
}


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("experiment", 3),
        ("prior", {"a": dist.Uniform(0.0, 1.0)}),
        ("extensions", "drift=0.3"),
        ("extensions", {"drift": dist.HalfNormal(1.0)}),
        ("earlier", 3),
        ("earlier", ({"a": [0.5]}, np.zeros((1, 30)))),
        ("held_out", GOOD["experiment"]),
        ("held_out", [3]),
        ("proposals", 3),
        ("proposals", [GOOD["experiment"]]),
        ("accept", "drift"),
        ("accept", ["drfit"]),
        ("level", 5),
        ("level", np.nan),
        ("plan", 3),
        ("bank", 3),
        ("executor", 3),
        ("batch", 0),
        ("seed", -1),
        ("timeout", -1.0),
        ("report", "loud"),
    ],
)
def test_a_criticism_refuses_what_makes_no_sense(argument, value):
    with pytest.raises(ValueError, match=rf"\b{argument.removesuffix('s')}s?\b"):
        criticism.criticise(**GOOD | {argument: value})


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: criticism.Experiment("simulate", OBSERVED, NOISE), "simulate"),
        (lambda: criticism.Experiment(refuse, "observed", NOISE), "observed"),
        (lambda: criticism.Experiment(refuse, OBSERVED, 0.01), "noise"),
        (lambda: criticism.Experiment(refuse, OBSERVED, NOISE, 3), "identity"),
        (lambda: criticism.Experiment(refuse, OBSERVED, NOISE, windows=3), "windows"),
        (lambda: criticism.Experiment(refuse, OBSERVED, NOISE, windows=[3]), "windows"),
        (lambda: criticism.Extension("flat"), "prior"),
        (lambda: criticism.Extension(dist.HalfNormal(1.0), "0"), "neutral"),
        (lambda: criticism.Extension(dist.HalfNormal(1.0), unit=3), "unit"),
        (lambda: criticism.Plan(base=-1), "base"),
        (lambda: criticism.Plan(extension=1), "extension"),
        (lambda: criticism.Plan(most=None), "most"),
    ],
)
def test_its_parts_refuse_what_makes_no_sense(make, argument):
    with pytest.raises(ValueError, match=rf"\b{argument}\b"):
        make()
