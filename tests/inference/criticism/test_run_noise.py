"""The covariance of the simulator's own noise, from runs far fewer than values."""

import itertools

import numpy as np
from bolfi_liquids.inference.criticism.misfit import slow_modes
from bolfi_liquids.inference.criticism.run_noise import errors_of, resized, smooth_covariance
from bolfi_liquids.inference.surrogates.measurement_noise import Layout, shrunk_covariance
from scipy.stats import norm

ALPHA = 1e-4  # false alarms per test
RUNS, SAMPLES, REPEATS, SLOW = 40, 200, 16, 6
BIAS = 0.15  # of the slow modes' variance
AT = Layout(np.zeros(SAMPLES, int), np.arange(SAMPLES))
MODES = slow_modes(AT, SLOW)


def smooth():
    """[SAMPLES, SAMPLES]: a correlation over five samples, thrice the size in the middle."""
    lag = np.subtract.outer(AT.sample, AT.sample)
    size = 1.0 + 2.0 * np.sin(np.pi * AT.sample / SAMPLES) ** 2
    return np.exp(-0.5 * (lag / 5.0) ** 2) * np.outer(size, size)


def towards_white(errors):
    """Ledoit and Wolf's."""
    found = shrunk_covariance(errors, 0)
    return found.factors @ found.factors.T + found.white * np.eye(SAMPLES)


def towards_smooth(errors):
    return smooth_covariance(errors, AT, True)


def estimates(truth, estimate):
    """Relative Frobenius errors [REPEATS]; of the slow modes' variances over the true ones the mean
    and its Monte Carlo error [SLOW]."""
    values, vectors = np.linalg.eigh(truth)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    errors, ratios = [], []
    for repeat in range(REPEATS):
        white = np.random.default_rng(repeat).normal(size=(RUNS, SAMPLES))
        found = estimate(white @ root.T)
        errors.append(np.linalg.norm(found - truth) / np.linalg.norm(truth))
        ratios.append(np.sum(MODES * (found @ MODES), 0) / np.sum(MODES * (truth @ MODES), 0))
    return np.array(errors), np.mean(ratios, 0), np.std(ratios, 0, ddof=1) / np.sqrt(REPEATS)


def test_the_slow_part_of_noise_is_as_large_as_it_is():
    """Shrinking smooth noise towards white makes it too small, and all of it worse."""
    ours, ratio, error = estimates(smooth(), towards_smooth)
    assert (np.abs(ratio - 1.0) + error < BIAS).all(), ratio
    theirs, ratio, error = estimates(smooth(), towards_white)
    assert (1.0 - ratio - norm.isf(ALPHA / SLOW) * error > BIAS).any() and (ratio < 1.0).all()
    assert (ours < theirs).all() and ours.mean() < 0.8 * theirs.mean()


def test_white_noise_is_found_nearly_as_well_as_if_it_were_known_to_be_white():
    """Sizes to 2 / sqrt(n * 15) each, 199 correlations to 1 / sqrt(n m) each."""
    errors, ratio, error = estimates(np.eye(SAMPLES), towards_smooth)
    assert (np.abs(ratio - 1.0) + error < BIAS).all(), ratio
    allowed = np.sqrt(2.0 / (RUNS * 15) + SAMPLES / (RUNS * SAMPLES))
    assert np.mean(errors) < 2.0 * allowed


def test_channels_of_unlike_size_and_of_samples_in_any_order_are_kept_apart():
    """As in a flattened output, whose channels alternate."""
    rng = np.random.default_rng(0)
    at = Layout(np.tile([0, 1], 100), np.repeat(np.arange(100), 2))
    errors = rng.normal(size=(RUNS, 200)) * np.where(at.channel == 0, 1.0, 10.0)
    found = np.diag(smooth_covariance(errors, at, True))
    means = found[at.channel == 0].mean(), found[at.channel == 1].mean()
    allowed = norm.isf(ALPHA) * np.sqrt(2.0 / (RUNS * 100))
    np.testing.assert_allclose(means, [1.0, 100.0], rtol=allowed)
    order = np.lexsort((at.sample, at.channel))
    sorted_at = Layout(at.channel[order], at.sample[order])
    np.testing.assert_allclose(
        smooth_covariance(errors[:, order], sorted_at, True),
        smooth_covariance(errors, at, True)[np.ix_(order, order)],
        rtol=1e-9,
        atol=1e-9,
    )


def test_single_values_are_shrunk_towards_independent_ones():
    rng = np.random.default_rng(0)
    errors = rng.normal(size=(500, 4)) @ np.linalg.cholesky(0.5 * np.eye(4) + 0.5).T
    found = smooth_covariance(errors, Layout(np.zeros(4, int), np.arange(4)), False)
    error = norm.isf(ALPHA / 16) * np.sqrt(2.0 / 500)
    np.testing.assert_allclose(found, 0.5 * np.eye(4) + 0.5, atol=error)


def test_differences_within_groups_are_as_large_as_the_noise():
    """Whatever the groups' means are, and however small the groups."""
    rng = np.random.default_rng(0)
    groups = [rng.normal(100.0 * k, 1.0, (2 + k % 3, 50)) for k in range(60)]
    errors = errors_of(groups)
    freedom = sum((len(group) - 1) * 50 for group in groups)
    assert abs(np.mean(errors**2) - 1.0) < norm.isf(ALPHA / 2) * np.sqrt(2.5 / freedom)


def test_noise_is_as_large_as_it_is_near_by():
    """Also at the ends, where an average over runs near by would be of one side."""
    rng = np.random.default_rng(0)
    u = rng.uniform(size=(60, 1))
    white = rng.normal(size=(60, SAMPLES))
    for growth, centre in itertools.product((1.0, 10.0), (0.02, 0.5, 0.98)):
        found = resized(growth**u * white, u, np.array([centre]))
        # six runs near by, of 200 values each, know a size to 2 %
        assert abs(np.sqrt(np.mean(found**2)) / growth**centre - 1.0) < 0.08


def test_a_deterministic_simulator_has_no_noise():
    still = np.zeros((RUNS, SAMPLES))
    assert not smooth_covariance(still, AT, True).any()
    assert not resized(still, np.linspace(0.0, 1.0, RUNS)[:, None], np.array([0.5])).any()
