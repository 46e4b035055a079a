"""What the checks hand back: numbers against formulas, text, xarray, figures."""

import numpy as np
import numpyro.distributions as dist
import pytest
import xarray as xr
from scipy.stats import binom, binomtest

from bolfi_liquids import inference

PRIOR = inference.Prior({"a": dist.Normal(0.0, 1.0), "b": dist.Uniform(0.0, 1.0)})


def prior_as_posterior(observed, seed):
    """Right when the data say nothing, and they do not."""
    rng = np.random.default_rng(seed)
    return {"a": rng.normal(size=31), "b": rng.random(31)}, lambda theta: theta["a"]


def silent(theta, seeds):
    return np.ones((1, 3))


@pytest.fixture(scope="module")
def made():
    return inference.replicates(prior_as_posterior, silent, PRIOR, 80, draws=31, independent=True)


def test_coverage_is_a_count_with_its_binomial_interval(made):
    """Against a count of the intervals themselves; ends between two draws may differ."""
    result = inference.coverage(made, levels=(0.5, 0.9))
    ends = np.quantile(made.draws, [0.25, 0.75], axis=1, method="weibull")
    held = np.sum((ends[0] < made.truth) & (made.truth < ends[1]), axis=0)
    assert np.abs(result.covered[0] - held).max() <= 4
    for at in np.ndindex(result.covered.shape):
        reference = binomtest(int(result.covered[at]), 80, result.levels[at[0]])
        interval = reference.proportion_ci(0.99, "exact")
        np.testing.assert_allclose((result.low[at], result.high[at]), interval)
        assert result.p_values[at] == pytest.approx(reference.pvalue, abs=0.15)


def test_coverage_of_all_and_none_has_an_interval():
    def certain(observed, seed):
        return {"a": np.linspace(-99.0, 99.0, 31), "b": np.full(31, -1.0)}

    made = inference.replicates(certain, silent, PRIOR, 20, draws=31, independent=True)
    result = inference.coverage(made, levels=(0.8,))
    np.testing.assert_array_equal(result.rate, [[1.0, 0.0]])
    assert result.high[0, 0] == 1.0 and 0.7 < result.low[0, 0] < 0.8
    assert result.low[0, 1] == 0.0 and 0.2 < result.high[0, 1] < 0.3


def test_coverage_says_what_it_would_find(made):
    """Counts at that coverage fail in four of five cases, counts at a larger one less often."""
    result = inference.coverage(made, levels=(0.5, 0.9))
    rng, limit = np.random.default_rng(0), result.alpha / result.p_values.size
    for level, rate in zip(result.levels, result.noticed, strict=True):
        for truth, least, most in ((rate, 0.77, 0.83), (rate + 0.05, 0.0, 0.7)):
            counts = rng.binomial(80, truth, 4000)
            failed = 2.0 * binom.cdf(counts, 80, level) < limit
            assert least <= np.mean(failed) <= most
    assert f"up to {result.noticed[1]:.3f}" in str(result)


def test_tarp_follows_the_scale_of_no_parameter(made):
    """`a` in thousandths: the same curve."""

    def scaled(observed, seed):
        drawn, _ = prior_as_posterior(observed, seed)
        return {"a": 1e-3 * drawn["a"], "b": drawn["b"]}

    prior = inference.Prior({"a": dist.Normal(0.0, 1e-3), "b": dist.Uniform(0.0, 1.0)})
    other = inference.replicates(scaled, silent, prior, 80, draws=31, independent=True)
    np.testing.assert_array_equal(inference.tarp(made).ranks, inference.tarp(other).ranks)


def test_the_tarp_curve_is_a_distribution_within_its_band(made):
    result = inference.tarp(made)
    assert result.expected_coverage[0] == 0.0 and result.expected_coverage[-1] == 1.0
    assert (np.diff(result.expected_coverage) >= 0).all()
    assert (result.low <= result.expected_coverage).all()
    assert (result.expected_coverage <= result.high).all()
    for c, share in zip(result.credibility, result.expected_coverage, strict=True):
        assert share == pytest.approx(np.mean(result.ranks < c * 32 - 1e-9))


def test_ranks_are_those_of_the_draws(made):
    result = inference.sbc(made, quantities={"sum": lambda theta, _: theta["a"] + theta["b"]})
    assert result.names == ("a", "b", "sum", "log_density")
    below = np.sum(made.draws < made.truth[:, None], axis=1)
    np.testing.assert_array_equal(result.ranks[:, :2], below)
    together = np.sum(made.draws.sum(-1) < made.truth.sum(-1, keepdims=True), axis=1)
    np.testing.assert_array_equal(result.ranks[:, 2], together)
    np.testing.assert_array_equal(result.ranks[:, 3], below[:, 0])  # its density is `a`


@pytest.mark.filterwarnings("ignore:invalid value")
def test_what_cannot_be_checked_is_refused(made):
    for quantity, measure, named in (
        ("a", lambda theta, _: theta["a"], "'a'"),
        ("log_density", lambda theta, _: theta["a"], "log_density"),
        ("c", lambda theta, _: 1.0, "'c'"),
        ("c", lambda theta, _: np.log(-np.abs(theta["a"])), "32 NaN"),
    ):
        with pytest.raises(ValueError, match=named):
            inference.sbc(made, quantities={quantity: measure})


def test_results_read_and_write_and_are_drawn(made, tmp_path):
    import matplotlib.pyplot as plt

    checks = inference.sbc(made), inference.coverage(made), inference.tarp(made)
    figure, axes = plt.subplots(1, 3)
    for result, ax in zip(checks, axes, strict=True):
        assert "80 replicates" in str(result) and str(result).endswith("ok") and result.ok
        assert result == result and result != type(result)(**vars(result))  # arrays say no yes
        for data in (result.to_dataset(), made.to_dataset()):
            data.to_netcdf(tmp_path / "r.nc")
            with xr.open_dataset(tmp_path / "r.nc") as back:
                xr.testing.assert_equal(back.load(), data)
        assert result.plot(ax) is ax
        words = [text.get_text() for text in ax.get_legend().get_texts()]
        assert set(getattr(result, "names", ())) <= set(words)
    assert checks[0].plot().get_xlabel()
    figure.savefig(tmp_path / "f.png")
