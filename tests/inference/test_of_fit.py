"""`Fit.check` and `Fit.criticise` take simulator, options and noise from the fit."""

import copy
import pickle

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.checks.of_fit import LikeObserved, check_fit
from bolfi_liquids.inference.criticism.of_fit import criticise_fit, noise_of

from bolfi_liquids import inference

TIME = np.linspace(0.0, 5.0, 50)
PRIOR = inference.Prior({"decay": dist.LogUniform(0.1, 10.0)})
EXTENSIONS = {"drift": criticism.Extension(dist.Normal(0.0, 0.1))}
SHORT = {"sampler": "quadrature", "chains": 2, "draws": 64}
SD = 0.05


def simulate(theta, seeds):
    """A decay, which may drift."""
    drift = theta.get("drift", np.zeros(len(seeds)))[:, None]
    noise = np.stack([np.random.default_rng(seed).normal(0.0, 0.01, 50) for seed in seeds])
    return np.exp(-TIME / theta["decay"][:, None]) + drift * TIME + noise


def observed(drift=0.0):
    truth = {"decay": np.array([2.0]), "drift": np.array([drift])}
    return simulate(truth, [10**6])[0] + np.random.default_rng(1).normal(0.0, SD, 50)


def fitted(data=None, **options):
    given = {"budget": 12, "progress": False, "warn": False, **options}
    return inference.fit(simulate, PRIOR, observed(0.03) if data is None else data, **given)


@pytest.fixture(scope="module")
def fit():
    return fitted(noise=SD)


def test_the_effect_that_a_fit_lacks_is_named(fit):
    found = fit.criticise(EXTENSIONS, windows=[criticism.Window({"half": 1}, TIME < 2.5)])
    assert found.accepted == ("drift",)
    interval = found.coefficients["drift"]
    assert interval.q05 < 0.03 < interval.q95
    assert [one.label for one in found.before] == [{"half": 1}]


def test_the_simulations_of_a_fit_are_not_made_again(fit):
    """The same as `criticise` with what the fit learned from."""
    rows, history = fit.training_mask, fit.history
    earlier = fit.prior.to_dict(history.theta[rows]), history.signals[rows], history.seeds[rows]
    data = criticism.Experiment(simulate, fit.observed, criticism.KnownNoise(SD))
    expected = criticism.criticise(data, PRIOR, EXTENSIONS, earlier=earlier)
    found = fit.criticise(EXTENSIONS)
    assert found.verdict == expected.verdict and found.simulations == expected.simulations
    np.testing.assert_array_equal(found.posterior.weights, expected.posterior.weights)


def test_any_surrogate_s_fit_is_criticised_with_a_noise_that_is_known():
    fit = fitted(surrogate="discrepancy")
    with pytest.raises(ValueError, match="noise=, such as"):
        fit.criticise(EXTENSIONS)
    found = fit.criticise(EXTENSIONS, noise=criticism.KnownNoise(SD))
    assert found.accepted == ("drift",)


@pytest.mark.parametrize(
    "noise",
    [SD, np.full(49, SD), criticism.KnownNoise(SD), None],
    ids=["number", "sds beside gaps", "noise", "estimated"],
)
def test_the_noise_of_a_fit_is_that_of_its_criticism(noise):
    """As it was given, at the samples that were observed; estimated it holds the simulator's."""
    data = observed()
    data[7] = np.nan
    at = criticism.measurement_noise.samples(data)
    covariance = noise_of(fitted(data, noise=noise)).covariance(at)
    assert covariance.shape == (49, 49)
    assert np.sqrt(np.diag(covariance)) == pytest.approx(SD, rel=0.25 if noise is None else 1e-6)


def test_sds_stand_where_they_were_given():
    """Of two channels: the fit's values go channel by channel, the noise sample by sample."""
    sds = 0.1 + np.arange(20.0).reshape(10, 2)

    def two(theta, seeds):
        return theta["decay"][:, None, None] * np.ones((len(seeds), 10, 2))

    data = np.ones((10, 2))
    data[3, 1] = np.nan
    there = np.isfinite(data)
    for noise in (sds, sds[there]):
        fit = inference.fit(two, PRIOR, data, noise=noise, budget=8, progress=False, warn=False)
        np.testing.assert_array_equal(noise_of(fit).sd, sds[there])


@pytest.mark.parametrize(
    "noise",
    ["poisson", inference.relative(0.2), SD**2 * np.eye(50)],
    ids=["counts", "relative", "covariance"],
)
def test_noise_of_which_no_draws_can_be_made_is_refused(noise):
    fit = fitted(np.round(100.0 * np.abs(observed())), noise=noise)
    for call in (fit.check, lambda: fit.criticise(EXTENSIONS)):
        with pytest.raises(ValueError, match="noise"):
            call()


def test_a_fit_of_log_likelihoods_has_no_data_to_simulate():
    calls = []

    def log_likelihood(theta, seeds):
        calls.append(seeds)
        return -0.5 * np.log(theta["decay"]) ** 2

    how = {"surrogate": "log_likelihood", "budget": 8, "progress": False, "warn": False}
    fit, made = inference.fit(log_likelihood, PRIOR, **how), len(calls)
    for call in (fit.check, lambda: fit.criticise(EXTENSIONS, noise=criticism.KnownNoise(SD))):
        with pytest.raises(ValueError, match="its simulator returns log likelihoods"):
            call()
    assert len(calls) == made


def test_only_a_fit_is_checked_and_criticised():
    for call in (lambda: check_fit(3), lambda: criticise_fit(3, {})):
        with pytest.raises(ValueError, match="fit must be of the type Fit, got 3"):
            call()


def test_a_fit_of_earlier_simulations_is_criticised_and_checked():
    theta = PRIOR.from_unit(np.linspace(0.05, 0.95, 12)[:, None])
    earlier = theta, simulate(theta, np.arange(12)), np.arange(12)
    fit = fitted(noise=SD, budget=0, earlier=earlier)
    assert fit.criticise(EXTENSIONS).accepted == ("drift",)
    found = fit.check(2, sampling=SHORT, draws=7, progress=False)
    assert not found.sbc.replicates.failed


def test_without_a_simulator_nothing_is_checked(fit):
    engine = inference.Bolfi(PRIOR, observed(), noise=SD)
    theta = engine.ask(8)
    engine.tell(theta, simulate(theta, np.arange(8)))
    for one in (engine.fit(warn=False), pickle.loads(pickle.dumps(fit)), copy.copy(fit)):
        for call in (one.check, lambda one=one: one.criticise(EXTENSIONS)):
            with pytest.raises(ValueError, match="the fit has no simulator"):
                call()


def test_data_are_like_the_observed_ones():
    there = np.arange(6000) % 3 > 0
    like = LikeObserved(there, criticism.KnownNoise(SD))
    seen = like(np.ones(6000), np.random.default_rng(0))
    np.testing.assert_array_equal(np.isfinite(seen), there)
    assert seen[there].std() == pytest.approx(SD, rel=0.05)
    np.testing.assert_array_equal(LikeObserved(there, None)(np.ones(6000), None)[there], 1.0)


@pytest.mark.slow
def test_a_check_is_that_of_the_fit_s_own_pipeline(fit):
    how = {"draws": 15, "progress": False}
    found = fit.check(3, sampling=SHORT, **how)
    options = {"noise": SD, "batch": 4, "initial": 8}
    pipeline = inference.FitPipeline(simulate, PRIOR, 12, options, SHORT, warn=False)
    observe = LikeObserved(np.ones(50, bool), criticism.KnownNoise(SD))
    expected = inference.replicates(pipeline, n=3, observe=observe, **how)
    np.testing.assert_array_equal(found.sbc.replicates.draws, expected.draws)
    assert str(found).count("3 replicates") == 3
    assert found.ok == (not found.warnings) and len(set(found.warnings)) == len(found.warnings)


@pytest.mark.slow
def test_noise_that_the_fit_thinks_too_small_is_found():
    """A misfit is no part of this pipeline, and its data scatter three times as much."""
    fit = fitted(noise=SD, misfit=0)
    loud = LikeObserved(np.ones(50, bool), criticism.KnownNoise(3.0 * SD))
    found = fit.check(24, sampling=SHORT, draws=15, observe=loud, progress=False)
    assert not found.ok and any("intervals hold the truth" in said for said in found.warnings)
