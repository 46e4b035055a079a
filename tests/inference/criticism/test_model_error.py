"""A model error of known size and correlation: coverage against the truth, with and without it."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import Bolfi, Prior
from bolfi_liquids.inference.criticism import KnownNoise, SumOfNoises, model_error, rhythm
from bolfi_liquids.inference.surrogates.measurement_noise import Layout
from scipy.stats import binom

SAMPLES, TIME, SIZE, NOISE, TRUTH = 100, 8.0, 0.5, 0.1, 2.0
SHAPE = np.sin(2.0 * np.pi * np.arange(SAMPLES) / 30.0)
PRIOR = Prior({"a": dist.Uniform(0.0, 4.0)})
DATA, ALPHA = 40, 1e-3
LAGS = np.abs(np.subtract.outer(np.arange(SAMPLES), np.arange(SAMPLES)))
ERRS = SIZE**2 * np.exp(-LAGS / TIME)
KNOWN = KnownNoise(NOISE)
BESIDE = SumOfNoises((KNOWN, model_error(SIZE, TIME)))


def intervals(noise):
    """90 % intervals [DATA, 2] of the amplitude that makes SHAPE, from 12 runs spread evenly."""
    rng = np.random.default_rng(7)
    errors = rng.multivariate_normal(np.zeros(SAMPLES), ERRS, size=DATA)
    runs = PRIOR.from_unit((np.arange(12.0)[:, None] + 0.5) / 12.0)
    signals = runs["a"][:, None] * SHAPE + 0.02 * rng.normal(size=(12, SAMPLES))
    at = PRIOR.from_unit((np.arange(2000)[:, None] + 0.5) / 2000.0)
    found = []
    for error in errors:
        observed = TRUTH * SHAPE + error + NOISE * rng.normal(size=SAMPLES)
        engine = Bolfi(PRIOR, observed, noise=noise, misfit=0.0)
        engine.tell(runs, signals)
        log_density = engine.fit(warn=False).log_prob(at)
        mass = np.cumsum(np.exp(log_density - log_density.max()))
        found.append(np.interp([0.05, 0.95], mass / mass[-1], at["a"]))
    return np.array(found)


def held(found):
    return int(np.sum((found[:, 0] <= TRUTH) & (found[:, 1] >= TRUTH)))


@pytest.mark.slow
def test_intervals_hold_beside_the_error_and_only_then():
    """The exact posterior has an sd of 0.144; coverage of 0.6 would pass once in 1e3."""
    found = intervals(BESIDE)
    assert held(found) >= binom.ppf(ALPHA, DATA, 0.9)
    exact = 1.0 / np.sqrt(SHAPE @ np.linalg.solve(ERRS + NOISE**2 * np.eye(SAMPLES), SHAPE))
    assert np.ptp(found, 1).mean() == pytest.approx(3.29 * exact, rel=0.1)
    assert held(intervals(KNOWN)) < binom.ppf(ALPHA, DATA, 0.9)


def test_a_process_has_the_size_and_correlation_that_were_given():
    at = Layout(np.repeat([0, 1], SAMPLES), np.tile(np.arange(SAMPLES), 2))
    found = model_error(SIZE, TIME).covariance(at)
    np.testing.assert_allclose(found[:SAMPLES, :SAMPLES], ERRS, atol=1e-4)
    assert not found[:SAMPLES, SAMPLES:].any()


def test_the_rhythm_of_a_sine_is_its_cosine():
    found = rhythm(np.column_stack([SHAPE, 5.0 + SHAPE]))
    expected = np.cos(2.0 * np.pi * np.arange(60) / 30.0) * (1.0 - np.arange(60) / SAMPLES)
    np.testing.assert_allclose(found[:60], expected, atol=0.1)
    assert rhythm(np.ones((5, 2))).tolist() == [1.0]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((-1.0, 3.0), "size must be finite and not negative"),
        ((np.nan, 3.0), "size must be finite and not negative"),
        ((1.0, 0.0), "correlation must be a positive number of samples"),
        ((1.0, [0.5, 0.2]), "correlation must be a positive number of samples"),
        ((1.0, 3.0, 0.0), "freedom must be finite and positive"),
    ],
)
def test_what_is_no_error_is_refused(arguments, said):
    with pytest.raises(ValueError, match=said):
        model_error(*arguments)


def test_noise_of_samples_is_refused_for_a_summary_of_them():
    with pytest.raises(ValueError, match="noise of samples is not that of their summary"):
        Bolfi(PRIOR, SHAPE, summary=lambda y: y[:7], noise=KNOWN)
