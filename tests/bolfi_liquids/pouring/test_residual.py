"""The process between map and given pours, against exact conditioning of Gaussians."""

import numpy as np
from scipy.stats import chi2

from bolfi_liquids.criticism.pours import ACTION_STEP, REPEATABILITY_SD, action_coordinates
from bolfi_liquids.pouring.given import (
    Residual,
    angle,
    expected_share,
    learn_residual,
    share,
)

ALPHA = 1e-4  # false alarms per test
SD, LENGTHS = 0.15, np.array([0.9, 1.4])


def covariance(a, b):
    """Of the true process, written out anew."""
    apart = (a[:, None, :] - b[None, :, :]) / LENGTHS
    return SD**2 * np.exp(-0.5 * (apart**2).sum(axis=2))


def test_outcomes_become_the_posterior_of_a_linear_model(rng):
    """Outcomes are g(action) w with normal w: with process and noise, all of it is normal."""
    given, wanted = rng.uniform(-1.0, 1.0, (6, 2)), rng.uniform(-2.0, 2.0, (5, 2))
    observed = rng.normal(0.7, 0.2, 6)
    mean, factor = np.array([0.6, 0.1, -0.05]), np.diag([0.1, 0.08, 0.05])
    basis_given, basis_wanted = (np.column_stack([np.ones(len(x)), x]) for x in (given, wanted))
    w = mean + rng.standard_normal((100_000, 3)) @ factor
    moved, sd = Residual(given, observed, SD, LENGTHS).moved(
        w @ basis_given.T, w @ basis_wanted.T, wanted
    )
    prior = factor @ factor.T
    whole = basis_given @ prior @ basis_given.T + covariance(given, given)
    whole += REPEATABILITY_SD**2 * np.eye(6)
    cross = basis_wanted @ prior @ basis_given.T + covariance(wanted, given)
    alone = basis_wanted @ prior @ basis_wanted.T + covariance(wanted, wanted)
    left = observed - basis_given @ mean
    exact = basis_wanted @ mean + cross @ np.linalg.solve(whole, left)
    variance = np.diag(alone - cross @ np.linalg.solve(whole, cross.T)) + REPEATABILITY_SD**2
    np.testing.assert_allclose(moved.mean(axis=0), exact, atol=2e-3)
    np.testing.assert_allclose(moved.var(axis=0) + sd**2, variance, rtol=0.02)


def errors(rng, times, wanted=8):
    """Of pours that are predicted from twelve others, in units of their sd (times * wanted,)."""
    found = []
    for _ in range(times):
        at = rng.uniform(0.0, 4.0, (12 + wanted, 2))
        noisy = covariance(at, at) + REPEATABILITY_SD**2 * np.eye(len(at))
        seen = 0.5 + rng.multivariate_normal(np.zeros(len(at)), noisy)
        here = np.full((64, 12), 0.5)
        learned = learn_residual(at[:12], seen[:12], here, 0.08, (1.0, 1.0))
        mean, sd = learned.moved(here, np.full((64, wanted), 0.5), at[12:])
        found.append((seen[12:] - mean[0]) / sd)
    return np.array(found)


def test_pours_that_were_left_out_are_as_far_as_is_said(rng):
    """Errors of one truth are correlated, so only one of each counts. Were they 2 times as large,
    it would be found."""
    squares = np.sum(errors(rng, 24)[:, 0] ** 2)
    low, high = chi2.ppf([ALPHA / 2.0, 1.0 - ALPHA / 2.0], 24)
    assert low < squares < high
    assert not low < 2.0**2 * squares < high


def test_what_outcomes_explain_is_no_residual():
    """Where the spread of the outcomes is as large as what is missed, the process is small."""
    at = np.column_stack([np.linspace(0.0, 4.0, 9), np.zeros(9)])
    slope = np.linspace(0.1, 0.5, 9)
    wide = 0.5 + np.linspace(-2.0, 2.0, 64)[:, None] * slope
    seen = 0.5 + slope
    explained, not_explained = (
        learn_residual(at, seen, here, 0.08, (1.0, 1.0)).sd
        for here in (wide, np.full((64, 9), 0.5))
    )
    assert explained < 0.5 * not_explained


def test_shares_of_angles_and_their_mean(rng):
    shares = rng.uniform(size=100)
    np.testing.assert_allclose(share(angle(shares)), shares, atol=1e-12)
    assert share(np.array([-0.3, 2.0])).tolist() == [0.0, 1.0]
    means, sds = np.array([[0.0, 0.07, 0.8, 1.5]]), np.array([0.1, 0.03, 0.2, 0.2])
    drawn = share(rng.normal(means, sds, (300_000, 4))).mean(axis=0)
    np.testing.assert_allclose(expected_share(means, sds)[0], drawn, atol=2e-3)


def test_actions_are_alike_by_ratio_of_speed_and_difference_of_distance():
    x = action_coordinates(np.array([1.0, 2.0, 4.0]), np.array([0.0, 0.007, 0.014]))
    steps = np.diff(x, axis=0)
    np.testing.assert_allclose(steps[:, 0], np.log(2.0) / ACTION_STEP[0])
    np.testing.assert_allclose(steps[:, 1], 1.0)
