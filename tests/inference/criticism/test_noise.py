"""Noise and model error: learned from rest and clean data, drawn as believed, given to a fit."""

import itertools
from dataclasses import replace

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.measurement_noise import CORRELATIONS, gaussian
from bolfi_liquids.inference.criticism.model_errors import REPEATED
from bolfi_liquids.inference.surrogates.measurement_noise import Layout
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.stats import binom, chi2, chisquare, invgamma, norm

from bolfi_liquids import inference

ALPHA = 1e-4  # false alarms per test
DRAWS, RUNS, BINS = 63, 128, 8  # of the rank test; the bins divide DRAWS + 1
FREEDOM = 20


def learned(residuals, noises, same, distances=None):
    """The model error that these clean data teach."""
    far = np.zeros(len(residuals)) if distances is None else distances
    given = zip(residuals, noises, same, far, strict=True)
    return criticism.learned_model_error([criticism.CleanData(*one) for one in given])


def autoregressive(rng, shape, sd, correlation):
    """Stationary AR(1) noise along the first axis."""
    white = rng.normal(size=shape)
    white[1:] *= np.sqrt(1.0 - correlation**2)
    return sd * lfilter([1.0], [1.0, -correlation], white, axis=0)


# Learned from rest.


@pytest.fixture(scope="module")
def rests():
    """Truths [RUNS, 2] and posterior draws [RUNS, DRAWS, 2] of size and correlation.

    The correlation comes from the prior. That of the size is improper, but invariant under
    scaling, so that its ranks are uniform at every true size.
    """
    rng = np.random.default_rng(0)
    truths, draws = [], []
    for run in range(RUNS):
        sd, correlation = 10.0 ** rng.uniform(-3.0, 3.0), rng.choice(CORRELATIONS)
        stretches = []
        for samples in (30, 18):
            line = np.stack([np.ones(samples), np.arange(samples)], axis=1)
            drift = line @ rng.normal(0.0, [[100.0 * sd], [sd]], (2, 2))
            stretches.append(drift + autoregressive(rng, (samples, 2), sd, correlation))
        found = criticism.rest_noise(stretches, seed=run, trend=1, draws=DRAWS)
        truths.append([sd, correlation])
        draws.append(np.stack([found.sd, found.correlation], -1))
    return np.array(truths), np.array(draws)


def p_uniform(truths, draws):
    """Of the truths' ranks, ties broken at random."""
    rng = np.random.default_rng(1)
    below, equal = (draws < truths[:, None]).sum(1), (draws == truths[:, None]).sum(1)
    ranks = below + rng.integers(0, equal + 1)
    return chisquare(np.histogram(ranks, BINS, (-0.5, DRAWS + 0.5))[0]).pvalue


@pytest.mark.parametrize("which", [0, 1], ids=["size", "correlation"])
def test_ranks_of_the_true_noise_are_uniform_among_its_posterior_draws(rests, which):
    """128 ranks find draws that are half as wide, or half an sd off, nearly always."""
    truths, draws = rests[0][:, which], rests[1][:, :, which]
    assert p_uniform(truths, draws) > ALPHA
    centre = np.median(draws, axis=1, keepdims=True)
    assert p_uniform(truths, centre + 0.4 * (draws - centre)) < ALPHA
    assert p_uniform(truths, draws + 0.7 * draws.std(1, keepdims=True)) < ALPHA


def test_a_trend_that_is_not_taken_out_is_taken_for_correlated_noise():
    rng = np.random.default_rng(0)
    rest = rng.normal(size=(60, 2)) + np.linspace(0.0, 10.0, 60)[:, None]
    straight = criticism.rest_noise([rest], trend=1)
    assert abs(straight.sd.mean() - 1.0) < 4.0 / np.sqrt(2.0 * rest.size)
    assert criticism.rest_noise([rest], trend=0).correlation.mean() > 0.8


# Drawn as believed.


def deviation(drawn, covariance):
    """Largest z of second moments [n, m], each with its own Monte Carlo error."""
    products = drawn[:, :, None] * drawn[:, None, :]
    return np.abs((products.mean(0) - covariance) / (products.std(0) / np.sqrt(len(drawn)))).max()


AR = criticism.AutoregressiveNoise(np.array([0.5, 0.7, 0.6]), np.array([0.2, 0.9, 0.6]))
SIZES = criticism.KnownNoise(np.linspace(0.1, 2.0, 16))
RESIDUALS = [autoregressive(np.random.default_rng(k), (10, 2), 1.0, 0.8) for k in range(FREEDOM)]
NOTHING = criticism.KnownNoise(0.0)
USUAL = learned(RESIDUALS, [NOTHING] * FREEDOM, [True] * FREEDOM)
NOISES = {
    "known": (criticism.KnownNoise(0.3), 1.0),
    "of each sample": (SIZES, 1.0),
    "autoregressive": (AR, 1.0),
    "sum": (criticism.SumOfNoises((AR, SIZES)), 1.0),
    # of a size that is known as well as a variance from FREEDOM numbers: Student's t
    "model error": (USUAL, FREEDOM / (FREEDOM - 2.0)),
}


def test_draws_have_the_covariance_that_is_believed():
    """Also beside gaps and in two channels; white draws of the same variances are found out."""
    at = np.delete(np.arange(20), [3, 4, 6, 11])
    gappy = Layout(at % 2, at // 2)  # sample after sample, some missing: a flattened output
    limit = norm.isf(ALPHA / 2 / 16**2)
    found = {}
    for kind, (noise, wider) in NOISES.items():
        drawn, covariance = (
            noise.draw(np.random.default_rng(0), gappy, 20_000),
            noise.covariance(gappy),
        )
        found[kind] = deviation(drawn, wider * covariance)
        assert deviation(1.05 * drawn, wider * covariance) > limit
    assert max(found.values()) < limit, found
    covariance = AR.covariance(gappy)
    white = criticism.KnownNoise(np.sqrt(np.diag(covariance)))
    drawn = white.draw(np.random.default_rng(0), gappy, 20_000)
    assert deviation(drawn, covariance) > 2.0 * limit


# Learned from clean data.

LENGTH, SETS, WHITE = 300, 30, 0.05


@pytest.fixture(scope="module")
def clean():
    """AR(1) residuals of unit variance, and white measurement noise."""
    rng = np.random.default_rng(0)
    shape = (LENGTH, 2)
    sets = [autoregressive(rng, shape, 1.0, 0.8) for _ in range(SETS)]
    return [one + np.sqrt(WHITE) * rng.normal(size=shape) for one in sets]


def test_the_autocovariance_of_a_stationary_process_is_recovered(clean):
    """Within Bartlett's errors; measurement noise, and the residuals' own noise, apart."""
    measured = criticism.KnownNoise(np.sqrt(WHITE))
    found = learned(clean, [measured] * SETS, [False] * SETS).autocovariance
    lags = np.arange(25)
    expected = 0.8**lags * (1.0 - lags / LENGTH)
    m = np.arange(-200, 201)
    process = 0.8 ** np.abs(m) + WHITE * (m == 0)

    def at(lag):
        return 0.8 ** np.abs(m + lag) + WHITE * (m + lag == 0)

    variance = np.array([np.sum(process**2 + at(lag) * at(-lag)) for lag in lags])
    error = np.sqrt(variance / (2 * SETS * LENGTH))
    limit = norm.isf(ALPHA / 2 / len(lags))
    assert np.abs((found[lags] - expected) / error).max() < limit
    ignored = learned(clean, [NOTHING] * SETS, [False] * SETS).autocovariance
    np.testing.assert_allclose(ignored[0] - found[0], WHITE, atol=0.01)


def test_residuals_of_the_same_experiment_say_where_it_errs_again(clean):
    at = Layout(np.repeat([0, 1], 40), np.tile(np.arange(40), 2))
    again = [residual[:40].copy() for residual in clean[:3]]
    again[1][7, 0] = np.nan
    noises, same = [criticism.KnownNoise(0.2)] * 3, [False, True, True]
    found = learned(again, noises, same)
    stationary = np.kron(np.eye(2), toeplitz(found.autocovariance))
    told = found.covariance(at)
    # two repetitions, as alike as they are like these data, leave no less of the variance
    remains = np.diag(told) / np.diag(stationary)
    assert 1.0 - 2.0 * REPEATED**2 / (1.0 + REPEATED) < remains.min() and remains.max() < 0.6
    expected = found.mean(at).reshape(2, 40).T
    for residual in again[1:]:
        seen = np.isfinite(residual)
        assert np.corrcoef(residual[seen], expected[seen])[0, 1] > 0.5
    # what repeats another experiment, or this one in another regime, tells nothing of where
    for other in (
        learned(again, noises, [False] * 3),
        learned(again, noises, same, [6.0, 6.0, 6.0]),
    ):
        np.testing.assert_allclose(other.covariance(at), stationary, atol=1e-12)
        assert not other.mean(at).any()
    assert (found.freedom, other.freedom) == (3, 3)


@pytest.mark.parametrize("away", [[0.0, 0.0], [0.5, -1.0]], ids=["one regime", "three regimes"])
def test_what_is_expected_of_a_simulator_is_right_as_often_as_it_says(away):
    """Drawn together from the model: misses, whitened, are chi-square."""
    at, drawn = Layout(np.repeat([0, 1], 30), np.tile(np.arange(30), 2)), 200
    places = np.array([0.0, *away])
    over = np.exp(-0.5 * np.subtract.outer(places, places) ** 2)
    over = REPEATED * over + (1.0 - REPEATED) * np.eye(3)
    process = np.kron(over, np.kron(np.eye(2), toeplitz(0.8 ** np.arange(30))))
    rng, measured = np.random.default_rng(0), criticism.KnownNoise(0.3)
    taught = learned(list(np.zeros((2, 30, 2))), [measured] * 2, [True] * 2, away)
    misses = []
    for truth in gaussian(rng, process, drawn).reshape(drawn, 3, 60):
        clean = [one.reshape(2, 30).T + 0.3 * rng.normal(size=(30, 2)) for one in truth[1:]]
        known = replace(
            taught,
            autocovariance=0.8 ** np.arange(30),
            clean=tuple(
                replace(one, residual=residual)
                for one, residual in zip(taught.clean, clean, strict=True)
            ),
        )
        miss = truth[0] - known.mean(at)
        misses.append(miss @ np.linalg.solve(known.covariance(at), miss))
    limits = chi2.ppf([ALPHA / 2, 1.0 - ALPHA / 2], 60 * drawn)
    assert limits[0] < np.sum(misses) < limits[1]
    assert np.trace(known.covariance(at)) < 0.75 * 60


def test_what_is_learned_in_another_regime_counts_little(clean):
    """One in which the simulator errs tenfold, far away."""
    two, none = list(clean[:2]), [NOTHING] * 3
    alone = learned(two, none[:2], [False] * 2)
    all_three = [*two, 10.0 * clean[2]]
    beside = learned(all_three, none, [False] * 3, [0.0, 0.0, 5.5])
    expected = alone.autocovariance
    np.testing.assert_allclose(beside.autocovariance, expected, atol=1e-3 * expected[0])
    assert beside.freedom == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize(("distance", "weight"), [(0.0, 1.0), (2.0, np.exp(-2.0)), (6.0, 0.0)])
def test_a_known_error_counts_as_clean_data_of_this_regime(clean, distance, weight):
    """Clean data far away say nothing, also where there are no nearer ones."""
    known = criticism.model_error(2.0, 0.8 ** np.arange(40), 3.0)
    data = [criticism.CleanData(one, NOTHING, True, distance) for one in clean[:2]]
    found = criticism.learned_model_error(data, known)
    alone = criticism.learned_model_error(data)
    expected = (3.0 * 2.0**2 + 2.0 * weight * alone.autocovariance[0]) / (3.0 + 2.0 * weight)
    assert found.autocovariance[0] == pytest.approx(expected, rel=0.01)
    assert found.freedom == pytest.approx(3.0 + 2.0 * weight, abs=1e-3)
    for *_, taught in found.leave_one_out():  # each by the known error and the other
        assert taught.freedom == pytest.approx(4.0, abs=1e-3)
    assert criticism.learned_model_error([], known) is known


@pytest.mark.parametrize(("sd", "agree"), [(0.1, True), (0.12, True), (0.5, False), (0.0, False)])
def test_the_size_is_known_as_well_as_its_sources_agree(sd, agree):
    """Thirty numbers of sd 0.1, five of another: pooled, or less than the pool where they differ.

    Sizes are inverse-gamma (Gelman et al. 2013, section 2.6). For two sources the squared z score
    of their difference is Birge's ratio.
    """
    alternating = sd * np.cos(np.pi * np.arange(40))[:, None]
    clean = [criticism.CleanData(alternating, NOTHING)] * 5
    found = criticism.learned_model_error(clean, criticism.model_error(0.1, 1.0, 30.0))
    pooled = (30 * 0.1**2 + 5 * sd**2) / 35
    assert found.autocovariance[0] == pytest.approx(pooled, rel=0.05)  # as positive as it must be
    z = (sd**2 - 0.1**2) / (pooled * np.sqrt(2 / 30 + 2 / 5))
    assert (abs(z) < 1.0) == agree
    assert found.freedom == pytest.approx(35.0 if agree else 35.0 / z**2)
    if agree:
        size, log_weight = found.sizes(50)
        closed = invgamma(35 / 2, scale=35 * found.autocovariance[0] / 2)
        log_density = closed.logpdf(size * found.autocovariance[0]) + np.log(size)
        np.testing.assert_allclose(np.diff(log_weight), np.diff(log_density), atol=1e-9)


def test_the_covariance_is_positive_semidefinite():
    """Also where the noise exceeds the residuals, they alternate, or the data are longer."""
    rng = np.random.default_rng(0)
    waves = np.cos(np.pi * np.arange(40))[:, None] * [1.0, -1.0]
    lengths = [rng.normal(size=(samples, 2)) for samples in (20, 40)]
    for residuals in ([waves], [waves, *lengths], [np.cumsum(waves, 0) + 3.0]):
        for noise, longest in itertools.product((0.0, 2.0), (12, 70)):
            noises = [criticism.KnownNoise(noise)] * len(residuals)
            found = learned(residuals, noises, [False] * len(residuals))
            at = Layout(np.zeros(longest, int), np.arange(longest))
            values = np.linalg.eigvalsh(found.covariance(at))
            assert values[0] > -1e-9 * max(values[-1], 1e-12)


def test_what_the_others_teach_is_learned_in_the_regime_of_the_one_left_out(clean):
    """Two regimes, in one of which the simulator errs tenfold."""
    sets = [clean[0], clean[1], 10.0 * clean[2], 10.0 * clean[3]]
    away = [0.0, 0.1, 6.0, 6.1]
    found = learned(sets, [NOTHING] * 4, [True] * 4, away)
    sizes = [taught.autocovariance[0] ** 0.5 for *_, taught in found.leave_one_out()]
    np.testing.assert_allclose(sizes, [1.0, 1.0, 10.0, 10.0], rtol=0.2)
    weights = [weight for _, weight, _ in found.leave_one_out()]
    assert weights[0] == 1.0 and weights[1] > 0.99 and max(weights[2:]) < 1e-3
    # one whose regime the others do not tell of is not judged
    alone = learned(clean[:3], [NOTHING] * 3, [True] * 3, [0.0, 0.3, 6.0])
    assert [one.regime_distance for one, *_ in alone.leave_one_out()] == [0.0, 0.3]


def test_a_simulator_that_leaves_nothing_leaves_nothing(clean):
    at = Layout(np.zeros(20, int), np.arange(20))
    found = learned([0.0 * clean[0]] * 2, [NOTHING] * 2, [True] * 2)
    assert not found.mean(at).any() and not found.covariance(at).any()


# Given.

SAMPLES, TIME, SIZE, SD, TRUTH = 100, 8.0, 0.5, 0.1, 2.0
SHAPE = np.sin(2.0 * np.pi * np.arange(SAMPLES) / 30.0)
DATA = 40
ERRORS = SIZE**2 * np.exp(-np.abs(np.subtract.outer(np.arange(SAMPLES), np.arange(SAMPLES))) / TIME)


def intervals(noise):
    """90 % intervals [DATA, 2] of the amplitude that makes SHAPE, from 12 runs spread evenly."""
    rng = np.random.default_rng(7)
    prior = inference.Prior({"a": dist.Uniform(0.0, 4.0)})
    errors = rng.multivariate_normal(np.zeros(SAMPLES), ERRORS, size=DATA)
    runs = prior.from_unit((np.arange(12.0)[:, None] + 0.5) / 12.0)
    signals = runs["a"][:, None] * SHAPE + 0.02 * rng.normal(size=(12, SAMPLES))
    at = prior.from_unit((np.arange(2000)[:, None] + 0.5) / 2000.0)
    found = []
    for error in errors:
        observed = TRUTH * SHAPE + error + SD * rng.normal(size=SAMPLES)
        engine = inference.Bolfi(prior, observed, noise=noise, misfit=0.0)
        engine.tell(runs, signals)
        log_density = engine.fit(warn=False).log_prob(at)
        mass = np.cumsum(np.exp(log_density - log_density.max()))
        found.append(np.interp([0.05, 0.95], mass / mass[-1], at["a"]))
    return np.array(found)


@pytest.mark.slow
def test_intervals_hold_beside_the_error_and_only_then():
    """The exact posterior has an sd of 0.144; coverage of 0.6 would pass once in 1e3."""
    known = criticism.KnownNoise(SD)
    beside = criticism.SumOfNoises((known, criticism.model_error(SIZE, TIME)))
    found, ignoring = intervals(beside), intervals(known)
    held = [np.sum((low <= TRUTH) & (high >= TRUTH)) for low, high in (found.T, ignoring.T)]
    assert held[0] >= binom.ppf(1e-3, DATA, 0.9) > held[1]
    exact = 1.0 / np.sqrt(SHAPE @ np.linalg.solve(ERRORS + SD**2 * np.eye(SAMPLES), SHAPE))
    assert np.ptp(found, 1).mean() == pytest.approx(3.29 * exact, rel=0.1)


def test_a_process_has_the_size_and_correlation_that_were_given():
    at = Layout(np.repeat([0, 1], SAMPLES), np.tile(np.arange(SAMPLES), 2))
    found = criticism.model_error(SIZE, TIME).covariance(at)
    np.testing.assert_allclose(found[:SAMPLES, :SAMPLES], ERRORS, atol=1e-4)
    assert not found[:SAMPLES, SAMPLES:].any()


def test_the_rhythm_of_a_sine_is_its_cosine():
    found = criticism.rhythm(np.column_stack([SHAPE, 5.0 + SHAPE]))
    expected = np.cos(2.0 * np.pi * np.arange(60) / 30.0) * (1.0 - np.arange(60) / SAMPLES)
    np.testing.assert_allclose(found[:60], expected, atol=0.1)
    assert criticism.rhythm(np.ones((5, 2))).tolist() == [1.0]
