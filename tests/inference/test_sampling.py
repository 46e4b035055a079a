"""Samplers against quadrature of the fitted posterior, and the form of what they return."""

import arviz_base
import jax
import numpy as np
import numpyro.distributions as dist
import pytest
import xarray as xr
from arviz_stats.base import array_stats
from bolfi_liquids.inference import nuts
from bolfi_liquids.inference.likelihood import log_likelihood
from scipy.stats import norm

from bolfi_liquids import inference

ALPHA = 1e-4  # false alarms per test
GRID = 200


def quadrature_mean(fit):
    """Posterior mean of u [d] on a midpoint grid."""
    axis = (np.arange(GRID) + 0.5) / GRID
    u = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)
    log_density = fit.log_prob(fit.prior.from_unit(u))
    weights = np.exp(log_density - log_density.max())  # both priors are uniform
    return weights @ u / weights.sum()


def z_scores(draws, truth):
    """Errors of the mean of draws [chain, draw, d] in Monte Carlo standard errors."""
    mcse = np.array([array_stats.mcse(draws[..., j]) for j in range(draws.shape[-1])])
    return np.abs(draws.mean((0, 1)) - truth) / mcse


@pytest.mark.parametrize("sampler", ["nuts", "emcee"])
def test_agrees_with_quadrature(line_fit, sampler):
    """A twin shifted by 0.3 posterior sd must fail: with ESS above 600 it is 7.3 standard
    errors off, where the bound is 4.1."""
    tree = line_fit.sample(sampler, seed=2)
    draws = line_fit.prior.to_unit(
        {n: tree["posterior"][n].to_numpy().ravel() for n in line_fit.prior.names}
    ).reshape(4, 1000, 2)
    bound = norm.ppf(1 - ALPHA / 4)
    truth = quadrature_mean(line_fit)
    assert (z_scores(draws, truth) < bound).all()
    assert (z_scores(draws + 0.3 * draws.std((0, 1)), truth) > bound).all()
    assert tree["posterior"].attrs["rhat_max"] < 1.02
    assert tree["posterior"].attrs["ess_bulk_min"] > 600


def test_compiles_once_for_all_fits(prior, observed, simulate):
    traces = []

    def counted(state, u):
        traces.append(None)
        return log_likelihood(state, u)

    length = nuts.Length(chains=2, warmup=20, draws=20)
    counts = []
    for budget in (7, 12, 20):  # data and padding fill up
        fit = inference.fit(simulate, prior, observed, budget=budget)
        with jax.enable_x64(True):
            nuts.sample_nuts(jax.random.key(0), counted, fit.learned.state, 2, length)
        counts.append(len(traces))
    assert counts[0] > 0
    assert counts[2] == counts[1] == counts[0]


def test_finds_separated_modes():
    """|a| is observed, so a and -a are equally likely."""
    prior = inference.Prior({"a": dist.Uniform(-1.0, 1.0)})
    fit = inference.fit(
        lambda theta, seeds: np.repeat(np.abs(theta["a"])[:, None], 3, 1),
        prior,
        np.full(3, 0.5),
        budget=24,
    )
    tree = fit.sample("emcee", draws=500)
    share = float((tree["posterior"]["a"] > 0).mean())
    assert 0.15 < share < 0.85


def test_tree_follows_the_schema_and_survives_the_disk(line_fit, tmp_path):
    tree = line_fit.sample("nuts", chains=2, draws=50, warmup=50)
    tree.to_netcdf(tmp_path / "posterior.nc", engine="h5netcdf")
    with xr.open_datatree(tmp_path / "posterior.nc", engine="h5netcdf") as back:
        assert {"posterior", "sample_stats", "prior", "observed_data", "constant_data"} < set(
            back.children
        )
        assert back["posterior"]["slope"].dims == ("chain", "draw")
        np.testing.assert_array_equal(back["posterior"]["slope"], tree["posterior"]["slope"])
        assert back["sample_stats"]["diverging"].dtype == bool
        assert back["simulations"]["signal"].shape == (20, 30)
        assert back["posterior"].attrs["divergences"] == int(tree["sample_stats"].diverging.sum())
        assert {"seed", "version", "sampler", "draws", "seconds_sampling"} < set(back.attrs)
        assert arviz_base.extract(back).sizes["sample"] == 100


def test_same_seed_same_draws(line_fit):
    a, b, c = (
        line_fit.sample("emcee", chains=2, draws=40, warmup=10, seed=seed)["posterior"]["slope"]
        for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(a, c)


def test_log_prob_is_prior_times_likelihood(line_fit):
    theta = {"slope": np.array([0.2, 0.9, 2.0]), "offset": np.array([0.7, 0.1, 0.5])}
    values = line_fit.log_prob(theta)
    inside = {name: v[:2] for name, v in theta.items()}
    mean, sd = line_fit.surrogate.predict(inside)
    expected = np.log(0.5) + norm.logcdf((line_fit.surrogate.threshold - mean) / sd)
    np.testing.assert_allclose(values[:2], expected, rtol=1e-6)
    assert values[2] == -np.inf
    assert line_fit.log_prob({"slope": 0.2, "offset": 0.7}).shape == ()


def test_the_global_precision_stays(line_fit):
    before = jax.config.jax_enable_x64
    line_fit.sample("nuts", chains=2, draws=50, warmup=50)
    assert jax.config.jax_enable_x64 is before is False
    assert jax.numpy.zeros(1).dtype == np.float32


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sampler": "gibbs"}, "sampler must be one of"),
        ({"chains": 1}, "chains >= 2"),
        ({"draws": 1}, "draws >= 4"),
    ],
)
def test_bad_options_are_refused(line_fit, options, message):
    with pytest.raises(ValueError, match=message):
        line_fit.sample(**options)
