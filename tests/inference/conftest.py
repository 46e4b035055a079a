"""A toy with a known answer: a noisy line, whose discrepancy is least near the truth."""

import numpy as np
import numpyro.distributions as dist
import pytest

from bolfi_liquids import inference

TRUTH = {"slope": np.array([0.3]), "offset": np.array([0.6])}
TIME = np.linspace(0.0, 1.0, 30)


def simulate_line(theta, seeds):
    """slope t + offset + noise of sd 0.05 -> [n, 30]."""
    noise = np.stack([np.random.default_rng(seed).normal(0.0, 0.05, TIME.size) for seed in seeds])
    return theta["slope"][:, None] * TIME + theta["offset"][:, None] + noise


@pytest.fixture(scope="session")
def simulate():
    return simulate_line


@pytest.fixture(scope="session")
def prior():
    return inference.Prior({"slope": dist.Uniform(-1.0, 1.0), "offset": dist.Uniform(0.0, 1.0)})


@pytest.fixture(scope="session")
def observed():
    return simulate_line(TRUTH, [12345])[0]


@pytest.fixture(scope="session")
def line_fit(simulate, prior, observed):
    distance = inference.squared_difference(TIME)
    # its noise is said to be large
    options = {"discrepancy": distance, "confirm": 0, "warn": False}
    return inference.fit(simulate, prior, observed, budget=20, **options)
