"""Thinning to independence, and ranks that pool unlike numbers of draws."""

import arviz_base
import numpy as np
import pandas as pd
import pytest
from bolfi_liquids.inference.checks import one_replicate as draws
from bolfi_liquids.inference.checks import ranks
from scipy.stats import chisquare

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
        np.testing.assert_array_equal(draws.posterior_array(given, ("a", "b")), wanted)
    flat = {name: column.ravel() for name, column in made.items()}
    for given in (flat, pd.DataFrame(flat)):
        assert draws.posterior_array(given, ("a", "b")).shape == (1, 6, 2)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        ({"a": np.zeros(3)}, "must hold the parameters"),
        ({"a": np.zeros(3), "b": np.zeros(4)}, "one shape"),
        ({"a": np.zeros((1, 2, 3)), "b": np.zeros((1, 2, 3))}, "one shape"),
        ({"a": np.zeros(0), "b": np.zeros(0)}, "not empty"),
        (np.zeros((3, 2)), "name -> draws"),
    ],
)
def test_refuses_other_forms(made, said):
    with pytest.raises(ValueError, match=said):
        draws.posterior_array(made, ("a", "b"))


def test_effective_size_of_known_chains():
    """AR(1) of correlation r keeps (1 - r) / (1 + r) of its draws; estimated within 35 %."""
    for correlation in (0.0, 0.6, 0.9):
        array = chains(correlation, (4, 2000))
        truth = 8000 * (1.0 - correlation) / (1.0 + correlation)
        assert draws.effective_size(array) == pytest.approx(truth, rel=0.35)
    assert draws.effective_size(np.ones((2, 50, 1))) == 1.0  # a chain that never moves


def test_thinned_draws_are_no_longer_correlated():
    """Two autocorrelation times of correlation 0.95 leave 0.02; one would leave 0.14."""
    products = []
    for seed in range(30):
        array = chains(0.95, (2, 8000), seed)
        kept = draws.thin(array, 10**4, draws.effective_size(array))[:, 0]
        products.append(kept[1:] * kept[:-1])
    pooled = np.concatenate(products)
    assert len(pooled) > 3000
    assert pooled.mean() < 0.018 + 4 / np.sqrt(len(pooled))


def test_keeps_no_more_than_there_are():
    array = np.arange(20.0).reshape(1, 20, 1)
    np.testing.assert_array_equal(draws.thin(array, 63, np.inf), array[0])
    assert len(draws.thin(array, 63, 8.0)) == 4
    assert len(draws.thin(array, 63, 1.0)) == 1


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


@pytest.mark.parametrize(
    ("n", "draws", "bins"), [(256, 63, 16), (100, 63, 8), (25, 63, 2), (256, 99, 20)]
)
def test_bins_divide_ranks_evenly(n, draws, bins):
    assert ranks.bin_count(n, draws) == bins
