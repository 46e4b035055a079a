"""Do intervals hold their truths? On the line toy, whose exact posterior is Gaussian."""

import numpy as np
import pytest
from scipy.stats import binom

from bolfi_liquids import inference

pytestmark = pytest.mark.filterwarnings("ignore::bolfi_liquids.inference.EmulatorWarning")

ALPHA = 1e-4  # false alarms
RUNS = 30


@pytest.fixture(scope="module")
def runs(prior, simulate):
    """Truths and posterior draws of both parameters, [RUNS, 2] and [RUNS, draws, 2]."""
    rng = np.random.default_rng(1)
    truths, draws = [], []
    for run in range(RUNS):
        theta = {"slope": rng.uniform(-1.0, 1.0, 1), "offset": rng.uniform(0.0, 1.0, 1)}
        observed = simulate(theta, [10**6 + run])[0]
        fit = inference.fit(simulate, prior, observed, budget=20, seed=run, surrogate="discrepancy")
        posterior = fit.sample(chains=2, draws=300, seed=run)["posterior"]
        truths.append([theta[name][0] for name in prior.names])
        draws.append(np.stack([posterior[name].to_numpy().ravel() for name in prior.names], -1))
    return np.array(truths), np.array(draws)


def covered(truths, draws):
    low, high = np.quantile(draws, [0.05, 0.95], axis=1)
    return int(np.sum((low <= truths) & (truths <= high)))


@pytest.mark.slow
def test_intervals_of_90_percent_cover_at_least_that_often(runs):
    """A posterior a third as wide as the engine's, twice too narrow, is caught."""
    truths, draws = runs
    least = binom.ppf(ALPHA, 2 * RUNS, 0.9)
    assert covered(truths, draws) >= least
    centre = draws.mean(axis=1, keepdims=True)
    assert covered(truths, centre + (draws - centre) / 8.0) < least
