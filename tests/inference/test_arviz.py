"""ArviZ's functions on a fit: a Gaussian line, of which every answer is a closed form."""

import arviz as az
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.linalg import toeplitz
from scipy.stats import multivariate_normal, norm

from bolfi_liquids import inference

pytestmark = pytest.mark.slow  # NUTS compiles

TIME = np.linspace(-1.0, 1.0, 24)
DESIGN = np.stack([np.ones_like(TIME), TIME], axis=1)
INDEPENDENT = 0.3**2 * np.eye(TIME.size)
CORRELATED = 0.3**2 * toeplitz(0.7 ** np.arange(TIME.size))
PRIOR = inference.Prior({"offset": dist.Normal(0.0, 1.0), "slope": dist.Normal(0.0, 1.0)})
TRUTH = np.array([0.5, -0.8])


def line(theta, seeds):
    return np.stack([theta["offset"], theta["slope"]], axis=-1) @ DESIGN.T


def observed(covariance, seed=4, truth=TRUTH):
    noise = np.random.default_rng(seed).multivariate_normal(np.zeros(TIME.size), covariance)
    return DESIGN @ truth + noise


def fitted(covariance, data, **options):
    how = {"budget": 30, "confirm": 0, "progress": False, "warn": False, "misfit": 0.0}
    return inference.fit(line, PRIOR, data, **{**how, "noise": covariance, **options})


def left_out(covariance, data):
    """Exact log p(y_i | y_-i) [m], parameters integrated out."""
    precision = np.linalg.inv(covariance + DESIGN @ DESIGN.T)
    error, variance = precision @ data / np.diag(precision), 1.0 / np.diag(precision)
    return norm.logpdf(error, scale=np.sqrt(variance))


@pytest.fixture(scope="module", params=["independent", "correlated"])
def task(request):
    covariance = INDEPENDENT if request.param == "independent" else CORRELATED
    data = observed(covariance)
    return covariance, data, fitted(covariance, data).sample()


def test_loo_is_the_exact_one(task):
    covariance, data, tree = task
    found = az.loo(tree, var_name="signal", pointwise=True)
    # 4000 draws, whose Monte Carlo errors are some 0.01 each
    np.testing.assert_allclose(found.elpd_i, left_out(covariance, data), atol=0.05)
    assert found.elpd == pytest.approx(left_out(covariance, data).sum(), abs=0.2)
    assert not found.warning


def test_densities_and_dependence_add_up_to_the_likelihood(task):
    covariance, data, tree = task
    group, posterior = tree["log_likelihood"], tree["posterior"]
    independent = (covariance == INDEPENDENT).all()  # but for the emulator's error, which is small
    assert ("dependence" in group) != independent
    total = group["signal"].sum("signal_dim_0") + (0.0 if independent else group["dependence"])
    means = line({name: posterior[name].to_numpy().ravel() for name in PRIOR.names}, None)
    exact = multivariate_normal.logpdf(data - means, np.zeros(TIME.size), covariance)
    np.testing.assert_allclose(total.to_numpy().ravel(), exact, atol=0.02)


def test_the_prior_s_density_is_in_natural_units(task):
    tree = task[-1]
    for name in PRIOR.names:
        np.testing.assert_allclose(
            tree["log_prior"][name], norm.logpdf(tree["posterior"][name]), atol=1e-9
        )


def test_predictions_before_the_data_have_the_prior_s_spread(task):
    covariance, _, tree = task
    before, after = tree["prior_predictive"]["signal"], tree["posterior_predictive"]["signal"]
    assert before.dims == after.dims == ("chain", "draw", "signal_dim_0")
    variance = np.diag(covariance + DESIGN @ DESIGN.T)
    # 1000 draws: five standard errors
    np.testing.assert_allclose(before.var(("chain", "draw")), variance, rtol=0.23)
    assert (before.std(("chain", "draw")) > 2.0 * after.std(("chain", "draw"))).all()
    az.plot_ppc_dist(tree, group="prior_predictive", num_samples=20)


def test_loo_pit_is_uniform_where_the_model_is_right_and_not_where_noise_is_twice_as_large():
    right = observed(INDEPENDENT)
    found = []
    for data in (right, right + 2.0 * (right - DESIGN @ TRUTH)):
        pit = az.loo_pit(fitted(INDEPENDENT, data).sample(draws=500))
        found.append(float(pit.azstats.uniformity_test(dim=["signal_dim_0"])[0]["signal"]))
    assert found[0] > 0.05 and found[1] < 0.001


@pytest.mark.parametrize(("offset", "conflict"), [(0.5, False), (3.5, True)])
def test_power_scaling_finds_the_conflict_of_prior_and_data(offset, conflict):
    data = observed(4.0 * CORRELATED, truth=np.array([offset, -0.3]))
    said = az.psense_summary(fitted(4.0 * CORRELATED, data).sample())["diagnosis"]
    assert ("conflict" in said["offset"]) is conflict
    assert "conflict" not in said["slope"]


@pytest.mark.parametrize("missing", [False, True])
def test_a_default_fit_of_channels_is_checked_by_arviz(missing):
    data = np.stack([observed(INDEPENDENT), observed(INDEPENDENT, seed=5)], axis=1)
    if missing:
        data[3:5, 0] = np.nan
    name = "values" if missing else "signal"
    fit = inference.fit(
        lambda theta, _: np.repeat(line(theta, _)[:, :, None], 2, axis=2),
        PRIOR,
        data,
        **{"budget": 20, "confirm": 0, "progress": False, "warn": False},
    )
    tree = fit.sample(draws=250)
    assert tree["posterior_predictive"]["signal"].shape == (4, 250, 24, 2)
    assert az.loo(tree, var_name=name).n_data_points == np.isfinite(data).sum()
    pit = az.loo_pit(tree, var_names=name)
    np.testing.assert_array_equal(pit[name].dims, tree["observed_data"][name].dims)
    az.plot_loo_pit(tree, var_names=name)


def test_what_a_surrogate_compares_as_one_datum_has_one_density():
    how = {"surrogate": "discrepancy", "budget": 20, "confirm": 0, "progress": False}
    tree = inference.fit(line, PRIOR, observed(INDEPENDENT), **how, warn=False).sample(draws=100)
    assert tree["log_likelihood"]["observed"].dims == ("chain", "draw")
    assert list(az.psense_summary(tree)["diagnosis"]) == ["✓", "✓"]
