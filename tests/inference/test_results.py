"""The tree: ArviZ's schema, units and priors, and the way to disk and back."""

import arviz_base
import numpy as np
import numpyro.distributions as dist
import pytest
import xarray as xr
from arviz_stats.base import array_stats

from bolfi_liquids import inference

pytestmark = pytest.mark.slow  # one fit with NUTS compiles for ten seconds

GROUPS = {
    "posterior",
    "prior",
    "log_prior",
    "log_likelihood",
    "prior_predictive",
    "sample_stats",
    "observed_data",
    "posterior_predictive",
    "constant_data",
    "simulations",
    "emulator_checks",
}


@pytest.fixture(scope="module")
def fit(simulate, observed):
    prior = inference.Prior(
        {"slope": dist.Uniform(-1.0, 1.0), "offset": dist.LogUniform(0.1, 2.0)},
        units={"slope": "rad/s"},
    )
    # twelve runs: its warnings are due
    return inference.fit(
        simulate, prior, observed, budget=12, confirm=0, surrogate="discrepancy", warn=False
    )


@pytest.fixture(scope="module")
def tree(fit):
    return fit.sample("nuts", draws=100, warmup=100)


def test_has_the_groups_of_the_schema(tree):
    assert set(tree.children) == GROUPS
    assert tree["posterior"]["slope"].dims == ("chain", "draw")
    assert tree["posterior"]["slope"].shape == (4, 100)
    assert tree["prior"]["slope"].shape == (1, 100)
    assert tree["sample_stats"]["diverging"].dtype == bool
    assert tree["sample_stats"]["n_steps"].dtype == int
    assert tree["simulations"]["signal"].shape == (12, 30)
    assert arviz_base.extract(tree).sizes["sample"] == 400


def test_draws_are_in_their_own_units_with_prior_and_unit(tree, fit):
    posterior, prior = tree["posterior"], tree["prior"]
    assert posterior["slope"].attrs["units"] == "rad/s"
    assert "units" not in posterior["offset"].attrs
    assert posterior["offset"].attrs["prior"] == "LogUniform(low=0.1, high=2)"
    assert prior["slope"].attrs["prior"] == "Uniform(low=-1, high=1)"
    assert tree["simulations"]["slope"].attrs["units"] == "rad/s"
    assert posterior["offset"].min() >= 0.1 and posterior["offset"].max() <= 2.0
    # prior draws: mean log of a log-uniform, to 4.5 standard errors
    logs = np.log(prior["offset"].to_numpy())
    spread = np.log(20.0) / np.sqrt(12.0 * logs.size)
    assert abs(logs.mean() - np.log(0.1 * 2.0) / 2.0) < 4.5 * spread


def test_measures_are_kept_where_they_belong(tree, fit):
    posterior = tree["posterior"]
    slope = posterior["slope"].to_numpy()
    attrs = posterior["slope"].attrs
    assert attrs["rhat"] == pytest.approx(float(array_stats.rhat(slope)))
    assert attrs["mcse_mean"] == pytest.approx(slope.std() / np.sqrt(attrs["ess_bulk"]), rel=0.3)
    # a tail quantile is harder than a mean, on one side at least
    assert max(attrs["mcse_q05"], attrs["mcse_q95"]) > attrs["mcse_mean"]
    assert posterior.attrs["rhat_max"] == max(v.attrs["rhat"] for v in posterior.values())
    assert posterior.attrs["ess_tail_min"] == min(v.attrs["ess_tail"] for v in posterior.values())
    assert posterior.attrs["divergences"] == int(tree["sample_stats"].diverging.sum())
    assert posterior.attrs["status"] == "converged"
    assert posterior.attrs["draws_made"] % 100 == 0
    assert (posterior.attrs["log_evidence"], posterior.attrs["log_evidence_error"]) == fit.evidence
    total = posterior.attrs["quadrature_total_variation"]
    assert 0.0 < total < posterior.attrs["quadrature_total_variation_limit"]


def test_the_surrogate_speaks_for_itself(tree, fit):
    learned = fit.learned
    for name, value in learned.constants().items():
        np.testing.assert_array_equal(tree["constant_data"][name], value)
    checks = tree["emulator_checks"]
    np.testing.assert_allclose(checks["loo_z"], learned.checks()["loo_z"])
    assert checks["loo_z"].dims[0] == "simulation"
    assert checks.attrs["warnings"] == "\n".join(fit.warnings)
    predicted = tree["posterior_predictive"]["discrepancy"]
    at = tree["posterior"].dataset
    assert predicted.sizes == at.sizes
    mean, sd = fit.surrogate.predict(
        {name: at[name].to_numpy().ravel() for name in fit.prior.names}
    )
    transform = learned.transform
    z = (transform(predicted.to_numpy().ravel()) - mean) / sd
    assert abs(z.mean()) < 4.5 / np.sqrt(z.size)
    assert 0.8 < z.std() < 1.2  # 400 draws: six standard errors


@pytest.mark.parametrize(
    "sampler", [pytest.param("nuts", marks=pytest.mark.slow), "emcee", "quadrature"]
)
def test_survives_the_disk(fit, tmp_path, sampler):
    tree = fit.sample(sampler, draws=40, warmup=40)
    tree.to_netcdf(tmp_path / "posterior.nc", engine="h5netcdf")
    with xr.open_datatree(tmp_path / "posterior.nc", engine="h5netcdf") as back:
        back.load()
    assert set(back.children) == set(tree.children)
    assert dict(back.attrs) == dict(tree.attrs)
    for name, group in tree.children.items():
        xr.testing.assert_identical(back[name].dataset, group.dataset)  # attributes, too
        for variable in group.data_vars:
            assert back[name][variable].dtype.kind == group[variable].dtype.kind


def test_how_it_was_made_is_at_the_root(tree):
    made = {"seed", "version", "sampler", "chains", "draws", "warmup", "extend", "sampling_seed"}
    assert made < set(tree.attrs)
    assert {"seconds_simulator", "seconds_engine", "seconds_sampling"} < set(tree.attrs)


def test_each_simulation_has_a_row_of_checks(simulate, prior, observed):
    """The third run fails and the fifth blows up: nothing is learned from these."""
    engine = inference.Bolfi(prior, observed, surrogate="signal")
    theta = engine.ask(12)
    signals = simulate(theta, range(12))
    signals[2], signals[4] = np.nan, 1e30
    engine.tell(theta, signals)
    fit = engine.fit()
    checks = fit.sample("quadrature", draws=8)["emulator_checks"]["loo_z"]
    assert checks.sizes["simulation"] == 12
    missing = np.isnan(checks.to_numpy()).all(1)
    np.testing.assert_array_equal(np.flatnonzero(missing), [2, 4])
    np.testing.assert_array_equal(checks[~missing], fit.learned.checks()["loo_z"])
