"""Thinning to independence, ranks that pool unlike numbers of draws, and their exact bands."""

import itertools

import arviz_base
import numpy as np
import pandas as pd
import pytest
from bolfi_liquids.inference.checks import one_replicate, ranks
from scipy.stats import binom, chisquare

ALPHA = 1e-4  # false alarms per test


def chains(correlation, shape, seed=0):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(*shape, 1))
    for step in range(1, shape[1]):
        new = np.sqrt(1.0 - correlation**2) * x[:, step]
        x[:, step] = correlation * x[:, step - 1] + new
    return x


def test_reads_mappings_and_trees_alike():
    made = {"b": np.arange(6.0).reshape(2, 3), "a": -np.arange(6.0).reshape(2, 3)}
    tree = arviz_base.from_dict({"posterior": made})
    wanted = np.stack([made["a"], made["b"]], -1)
    for given in (made, tree, tree["posterior"], tree["posterior"].to_dataset()):
        np.testing.assert_array_equal(one_replicate.posterior_array(given, ("a", "b")), wanted)
    flat = {name: column.ravel() for name, column in made.items()}
    for given in (flat, pd.DataFrame(flat)):
        assert one_replicate.posterior_array(given, ("a", "b")).shape == (1, 6, 2)


def test_refuses_other_forms():
    for made, said in (
        ({"a": np.zeros(3)}, "must hold the parameters"),
        ({"a": np.zeros(3), "b": np.zeros(4)}, "one shape"),
        ({"a": np.zeros((1, 2, 3)), "b": np.zeros((1, 2, 3))}, "one shape"),
        ({"a": np.zeros(0), "b": np.zeros(0)}, "not empty"),
        (np.zeros((3, 2)), "name -> draws"),
    ):
        with pytest.raises(ValueError, match=said):
            one_replicate.posterior_array(made, ("a", "b"))


def test_effective_size_of_known_chains():
    """AR(1) of correlation r keeps (1 - r) / (1 + r) of its draws; estimated within 35 %."""
    for correlation in (0.0, 0.6, 0.9):
        array = chains(correlation, (4, 2000))
        truth = 8000 * (1.0 - correlation) / (1.0 + correlation)
        assert one_replicate.effective_size(array) == pytest.approx(truth, rel=0.35)
    assert one_replicate.effective_size(np.ones((2, 50, 1))) == 1.0  # a chain that never moves


def test_thinned_draws_are_no_longer_correlated():
    """Two autocorrelation times of correlation 0.95 leave 0.02; one would leave 0.14."""
    products = []
    for seed in range(12):
        array = chains(0.95, (2, 8000), seed)
        kept = one_replicate.thin(array, 10**4, one_replicate.effective_size(array))[:, 0]
        products.append(kept[1:] * kept[:-1])
    pooled = np.concatenate(products)
    assert len(pooled) > 1200
    assert pooled.mean() < 0.018 + 4 / np.sqrt(len(pooled))


def test_keeps_no_more_than_there_are():
    array = np.arange(20.0).reshape(1, 20, 1)
    np.testing.assert_array_equal(one_replicate.thin(array, 63, np.inf), array[0])
    assert len(one_replicate.thin(array, 63, 8.0)) == 4
    assert len(one_replicate.thin(array, 63, 1.0)) == 1


def test_quantiles_are_uniform_whatever_the_number_of_draws():
    """4000 truths among 1 to 15 draws each; half the draws moved by 0.2 sd must fail."""
    rng = np.random.default_rng(2)
    pool, truth = rng.normal(size=(4000, 15)), rng.normal(size=4000)
    pool[np.arange(15) >= rng.integers(1, 16, 4000)[:, None]] = np.nan
    jitter = rng.random(4000)

    def p_value(draws):
        common = ranks.to_ranks(ranks.quantiles(truth, draws, jitter), 63)
        return chisquare(np.bincount(common // 4, minlength=16)).pvalue

    assert p_value(pool) > ALPHA
    assert p_value(pool + 0.2) < ALPHA


def test_plain_ranks_and_ties():
    full = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [5.0, 5.0, 5.0]])
    u = ranks.quantiles(np.array([0.0, 2.5, 5.0]), full, np.array([0.99, 0.0, 0.6]))
    np.testing.assert_array_equal(ranks.to_ranks(u, 3), [0, 2, 2])  # the tie at random: 4 x 0.6


def test_bins_divide_ranks_evenly():
    expected = {(256, 63): 16, (100, 63): 8, (25, 63): 2, (256, 99): 20, (9, 6): 2}
    assert {given: ranks.bin_count(*given) for given in expected} == expected


# Simultaneous bands.

RUNS = 2000


def outside(counts, band):
    return ((counts < band.lower) | (counts > band.upper)).any()


def counts_of(rng, n, draws):
    return ranks.counts_below(rng.integers(0, draws + 1, n), draws)


def test_p_value_is_that_of_all_possible_ranks():
    """Enumerated: the share of all rank vectors at least as far out as the one at hand."""
    n, most = 4, 3
    every = [np.array(one) for one in itertools.product(range(most + 1), repeat=n)]
    z = np.arange(1, most + 1) / (most + 1)

    def statistic(one):
        below = np.array([(one < k).sum() for k in range(1, most + 1)])
        return np.minimum(binom.cdf(below, n, z), binom.sf(below - 1, n, z)).min()

    found = np.array([statistic(one) for one in every])
    for one, value in list(zip(every, found, strict=True))[::6]:
        expected = np.mean(found <= value * (1 + 1e-12))
        assert ranks.p_value(one, most) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("n", "draws", "level"), [(256, 63, 0.95), (50, 31, 0.5)])
def test_holds_whole_curves_as_often_as_it_says(n, draws, level):
    """2000 sets of uniform ranks: standard error 0.005 at 0.95; discreteness may add 0.02."""
    rng = np.random.default_rng(0)
    band = ranks.band(n, draws, level)
    held = RUNS - sum(outside(counts_of(rng, n, draws), band) for _ in range(RUNS))
    assert held >= binom.ppf(ALPHA / 2, RUNS, level)
    assert held <= binom.isf(ALPHA / 2, RUNS, min(level + 0.02, 1.0))


def test_p_values_of_uniform_ranks_are_uniform():
    rng = np.random.default_rng(1)
    p = np.array([ranks.p_value(rng.integers(0, 16, 100), 15) for _ in range(RUNS // 4)])
    for level in (0.05, 0.3, 0.7):
        few, many = binom.ppf([ALPHA / 6, 1 - ALPHA / 6], p.size, level)
        assert few - 0.02 * p.size <= np.sum(p <= level) <= many


def test_many_replicates_and_certain_misfit_stay_finite():
    band = ranks.band(2000, 31, 0.95)
    assert (band.lower <= 2000 * band.z).all() and (2000 * band.z <= band.upper).all()
    assert ranks.p_value(np.zeros(2000, np.int64), 31) == pytest.approx(0.0, abs=1e-9)
