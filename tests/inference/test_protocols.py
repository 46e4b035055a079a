"""Every exported rule, family, noise, check and pipeline is found by itself; noises, checks and
pipelines keep their protocols, as surrogates and rules do in `tests/extensions`.

Kinds are told by what a class or function takes, not by a list of names: what is exported and of
a kind, but has no case here, fails.
"""

import inspect
from dataclasses import replace

import jax
import numpy as np
import pytest
from bolfi_liquids.inference.acquisition.rules import RULES
from bolfi_liquids.inference.surrogates.families import FAMILIES, resolve
from bolfi_liquids.inference.surrogates.measurement_noise import Layout

from bolfi_liquids import inference

pytestmark = pytest.mark.filterwarnings(
    "ignore::bolfi_liquids.inference.EmulatorWarning",
    "ignore::bolfi_liquids.inference.SamplingWarning",  # of a handful of draws
)

FACES = (inference, inference.surrogates, inference.checks, inference.criticism)
LAYOUT = Layout(np.tile([0, 1], 8), np.repeat(np.arange(8), 2))  # two channels of 8 samples


def exported(kind):
    """Name -> what the engine's faces export of a kind, the protocols themselves left out."""
    found = {name: getattr(face, name) for face in FACES for name in face.__all__}
    concrete = {name: one for name, one in found.items() if not getattr(one, "_is_protocol", False)}
    return {name: one for name, one in concrete.items() if kind(one)}


def called_with(one):
    """Names of the arguments that a class's objects are called with."""
    call = getattr(one, "__call__", None) if inspect.isclass(one) else None  # noqa: B004
    return tuple(inspect.signature(call).parameters)[1:] if inspect.isfunction(call) else ()


def is_rule(one):
    return called_with(one) == called_with(inference.surrogates.Acquisition)


def is_family(one):
    return inspect.isclass(one) and hasattr(one, "learn")


def is_noise(one):
    return inspect.isclass(one) and hasattr(one, "covariance") and hasattr(one, "draw")


def is_pipeline(one):
    return called_with(one) == called_with(inference.checks.Pipeline)


def is_check(one):
    """A function of `Replicates`."""
    given = inspect.signature(one).parameters.values() if inspect.isfunction(one) else ()
    return any(argument.annotation is inference.checks.Replicates for argument in given)


# What is exported has a name or a case.


def test_every_exported_rule_and_family_has_a_name_that_users_give():
    assert set(exported(is_rule).values()) == set(RULES.values())
    assert set(exported(is_family).values()) == set(FAMILIES.values())


def test_options_of_two_surrogates_are_not_guessed_between():
    """A discrepancy would only rank the simulations of the signal surrogate."""
    with pytest.raises(ValueError, match="discrepancy and noise"):
        resolve(None, {"discrepancy": max, "noise": 0.1})
    assert resolve(None, {"discrepancy": max}).name == "discrepancy"
    assert resolve("signal", {"discrepancy": max, "noise": 0.1}).name == "signal"
    assert resolve(None, {"discrepancy": None, "noise": 0.1}).name == "signal"
    assert resolve(None, {"discrepancy": max, "noise": None, "summary": None}).name == "discrepancy"


@pytest.fixture(scope="module")
def noises():
    white = inference.criticism.KnownNoise(0.3)
    correlated = inference.criticism.AutoregressiveNoise(np.array([0.5]), np.array([0.8]))
    residual = np.random.default_rng(0).normal(0.0, 1.0, (8, 2))
    error = inference.criticism.learned_model_error(
        [inference.criticism.CleanData(residual, white)]
    )
    return {
        inference.criticism.KnownNoise: white,
        inference.criticism.AutoregressiveNoise: correlated,
        inference.criticism.SumOfNoises: inference.criticism.SumOfNoises((white, correlated)),
        # of a size known well: draws of one known badly have no variance to judge them by
        inference.criticism.ModelError: replace(error, freedom=1000),
    }


@pytest.fixture(scope="module")
def pipelines(simulate, prior):
    options = {"surrogate": "discrepancy"}
    short = {"sampler": "emcee", "chains": 2, "draws": 64, "warmup": 20}
    return {
        inference.FitPipeline: [
            inference.FitPipeline(simulate, prior, 8, options, short),
            inference.shared_design(simulate, prior, 10, options=options, sampling=short),
        ]
    }


def test_every_exported_noise_and_pipeline_has_a_case(noises, pipelines):
    assert set(exported(is_noise).values()) == set(noises)
    assert set(exported(is_pipeline).values()) == set(pipelines)


def test_the_kinds_are_found():
    """By what is known to be exported today, so that no kind is found empty unnoticed."""
    assert "PosteriorDraws" in exported(is_rule) and "SignalFamily" in exported(is_family)
    assert "KnownNoise" in exported(is_noise) and "FitPipeline" in exported(is_pipeline)
    assert set(exported(is_check)) >= {"sbc", "coverage", "tarp"}


def finite(values):
    return bool(np.isfinite(np.asarray(values, float)).all())


# Noises.


def excess(noise, covariance, count=4000):
    """The trace of draws' covariance over what is stated, less 1, in standard errors."""
    drawn = noise.draw(np.random.default_rng(0), LAYOUT, count)
    squares = np.sum(drawn**2, axis=1)
    error = squares.std() / np.sqrt(count)
    return (squares.mean() - np.trace(covariance)) / error


def test_a_noise_keeps_its_protocol(noises):
    for kind, noise in noises.items():
        covariance = noise.covariance(LAYOUT)
        assert covariance.shape == (16, 16) and finite(covariance), kind
        np.testing.assert_allclose(covariance, covariance.T, atol=1e-12)
        assert np.linalg.eigvalsh(covariance).min() > -1e-9
        draws = [noise.draw(np.random.default_rng(seed), LAYOUT, 5) for seed in (0, 0, 1)]
        assert draws[0].shape == (5, 16) and finite(draws[0])
        np.testing.assert_array_equal(draws[0], draws[1])
        assert not np.array_equal(draws[0], draws[2])


def test_draws_of_a_noise_are_as_large_as_its_covariance_says(noises):
    """The two-sided chance of 4.5 standard errors is 7e-6; 30 % more would be found."""
    for kind, noise in noises.items():
        covariance = noise.covariance(LAYOUT)
        assert abs(excess(noise, covariance)) < 4.5, kind
        assert abs(excess(noise, covariance / 1.3)) > 4.5, kind


# Checks of calibration.


@pytest.fixture(scope="module")
def made(prior, simulate):
    """Replicates of a pipeline that draws from the prior, which no check can do without."""

    def ignoring(observed, seed):
        drawn = prior.sample(jax.random.key(seed), 31)
        return {name: np.asarray(values, float) for name, values in drawn.items()}

    return inference.replicates(ignoring, simulate, prior, 32, draws=31, independent=True)


def in_a_corner(made):
    """The same replicates with a gross fault: all draws near one corner of the prior."""
    finished = [r._replace(draws=[-0.95, 0.02] + 0.01 * r.draws) for r in made.finished]
    return replace(made, finished=finished)


@pytest.mark.parametrize("name", exported(is_check))
def test_a_check_keeps_its_protocol(made, name):
    """A table that ends in its judgement, the same each time, on replicates left as they are."""
    check, before = exported(is_check)[name], made.draws.copy()
    result = check(made, alpha=1e-4)
    assert result.replicates is made
    assert isinstance(result.ok, bool | np.bool_) and result.ok  # prior draws are calibrated
    assert str(result) == str(check(made, alpha=1e-4))
    assert not check(in_a_corner(made), alpha=1e-4).ok
    np.testing.assert_array_equal(made.draws, before)


# Pipelines.


@pytest.mark.parametrize("kind", exported(is_pipeline))
def test_a_pipeline_keeps_its_protocol(pipelines, prior, observed, kind):
    for pipeline in pipelines[exported(is_pipeline)[kind]]:
        (drawn, log_density), (again, _), (other, _) = (
            pipeline(observed, seed) for seed in (0, 0, 1)
        )
        for name in prior.names:
            values = drawn["posterior"][name]
            assert values.dims == ("chain", "draw") and values.dtype == np.float64
            assert finite(values)
            np.testing.assert_array_equal(values, again["posterior"][name])
            assert not np.array_equal(values, other["posterior"][name])
        assert log_density({name: np.full(3, 0.5) for name in prior.names}).shape == (3,)
