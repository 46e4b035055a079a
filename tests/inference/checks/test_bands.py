"""The exact band against enumeration and simulation."""

import itertools

import numpy as np
import pytest
from bolfi_liquids.inference.checks import ranks as bands
from scipy.stats import binom

ALPHA = 1e-4  # false alarms per test
RUNS = 4000


def outside(counts, band):
    return ((counts < band.lower) | (counts > band.upper)).any()


def counts_of(rng, n, draws):
    return bands.counts_below(rng.integers(0, draws + 1, n), draws)


@pytest.mark.parametrize(("n", "draws"), [(3, 2), (4, 3)])
def test_p_value_is_that_of_all_possible_ranks(n, draws):
    """Enumerated: the share of all rank vectors at least as far out as the one at hand."""
    every = [np.array(ranks) for ranks in itertools.product(range(draws + 1), repeat=n)]
    z = np.arange(1, draws + 1) / (draws + 1)

    def statistic(ranks):
        below = np.array([(ranks < k).sum() for k in range(1, draws + 1)])
        return np.minimum(binom.cdf(below, n, z), binom.sf(below - 1, n, z)).min()

    found = np.array([statistic(ranks) for ranks in every])
    for ranks, value in list(zip(every, found, strict=True))[:: max(1, len(every) // 40)]:
        expected = np.mean(found <= value * (1 + 1e-12))
        assert bands.p_value(ranks, draws) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("n", "draws", "level"), [(100, 15, 0.95), (256, 63, 0.95), (50, 31, 0.5)])
def test_holds_whole_curves_as_often_as_it_says(n, draws, level):
    """4000 sets of uniform ranks: standard error 0.003 at 0.95; discreteness may add 0.02."""
    rng = np.random.default_rng(0)
    band = bands.band(n, draws, level)
    held = RUNS - sum(outside(counts_of(rng, n, draws), band) for _ in range(RUNS))
    assert held >= binom.ppf(ALPHA / 2, RUNS, level)
    assert held <= binom.isf(ALPHA / 2, RUNS, min(level + 0.02, 1.0))


def test_p_values_of_uniform_ranks_are_uniform():
    rng = np.random.default_rng(1)
    p = np.array([bands.p_value(rng.integers(0, 16, 100), 15) for _ in range(RUNS // 4)])
    for level in (0.05, 0.3, 0.7):
        few, many = binom.ppf([ALPHA / 6, 1 - ALPHA / 6], p.size, level)
        assert few - 0.02 * p.size <= np.sum(p <= level) <= many


def test_many_replicates_and_certain_misfit_stay_finite():
    band = bands.band(5000, 31, 0.95)
    assert (band.lower <= 5000 * band.z).all() and (5000 * band.z <= band.upper).all()
    assert bands.p_value(np.zeros(5000, np.int64), 31) == pytest.approx(0.0, abs=1e-9)
