"""Acquisition rules against brute force, and on targets far from everything."""

from dataclasses import replace

import jax
import numpy as np
from bolfi_liquids.inference._float64 import in_float64
from bolfi_liquids.inference.acquisition.rules import (
    RULES,
    exploration_width,
    log_moments,
    truncated_normal,
)
from bolfi_liquids.inference.gp.process import predict
from bolfi_liquids.inference.sobol import sobol
from bolfi_liquids.inference.surrogates.base import RunOutcomes, Surrogate
from bolfi_liquids.inference.surrogates.discrepancy import learn, with_threshold
from bolfi_liquids.inference.surrogates.processes import learn_success, log_success
from scipy.stats import kstest, multivariate_normal, norm, qmc, truncnorm

from bolfi_liquids import inference

KEY = jax.random.key(0)
AXIS = np.linspace(0.0, 1.0, 41)
GRID = np.stack(np.meshgrid(AXIS, AXIS), -1).reshape(-1, 2)


def fitted(n=12, noise=0.0, rule=None):
    u = sobol(0, 0, n, 2)
    values = 1.0 + ((u - 0.4) ** 2).sum(-1) + noise * np.random.default_rng(0).normal(size=n)
    return with_threshold(learn(u, values, "identity"), rule)


def test_start_design_fills_the_box_and_continues():
    points = sobol(0, 0, 32, 2)
    np.testing.assert_array_equal(sobol(0, 5, 9, 2), points[5:9])
    random = np.random.default_rng(0).uniform(size=(32, 2))
    assert qmc.discrepancy(points) < 0.5 * qmc.discrepancy(random)
    assert not np.allclose(points, sobol(1, 0, 32, 2))


def test_lcb_minimises_mean_less_width_times_latent_sd():
    expected = np.sqrt(2 * np.log(20.0**3 * np.pi**2 / 0.3))  # the paper's schedule
    np.testing.assert_allclose(exploration_width(20, 2), expected)
    surrogate = fitted()
    chosen = inference.LowerConfidenceBound(jitter=1e-6)(KEY, surrogate, 1)
    (mean,), (variance,) = predict(surrogate.gp, np.concatenate([chosen, GRID]))
    bound = mean - exploration_width(12, 2) * np.sqrt(variance)
    assert bound[0] <= bound.min() + 1e-4


def test_jitter_is_a_normal_of_its_sd_about_the_minimiser():
    rule, surrogate = inference.LowerConfidenceBound(jitter=0.05), fitted()
    centre = inference.LowerConfidenceBound(jitter=1e-6)(KEY, surrogate, 1)[0]
    drawn = [rule(jax.random.key(i), surrogate, 1)[0] - centre for i in range(40)]
    interior = (centre > 0.2) & (centre < 0.8)
    z = np.array(drawn)[:, interior].ravel() / 0.05
    assert kstest(z, "norm").pvalue > 1e-4 and 0.68 < z.std() < 1.32  # four of its errors


def test_jitter_is_truncated_at_the_bounds():
    """One of twice its size is found."""
    rng = np.random.default_rng(0)
    points = np.array([truncated_normal(rng, np.array([0.02]), 0.05)[0] for _ in range(500)])
    expected = truncnorm(-0.4, 19.6, loc=0.02, scale=0.05)
    assert kstest(points, expected.cdf).pvalue > 1e-4
    assert kstest(points, truncnorm(-0.2, 9.8, loc=0.02, scale=0.1).cdf).pvalue < 1e-4


def test_second_moment_agrees_with_the_bivariate_normal():
    """E[Phi(..)^2] is the chance that two draws with a common latent mean both pass."""
    surrogate = fitted(noise=0.1, rule=1.2)
    points = GRID[::97]
    first, log_variance = log_moments(surrogate, points)
    mean, variance = predict(surrogate.gp, points)
    total = variance[0] + np.exp(2.0 * float(surrogate.gp.hyper.log_noise[0]))
    z = (float(surrogate.log_likelihood.threshold) - mean[0]) / np.sqrt(total)
    r = variance[0] / total
    both = np.array(
        [
            multivariate_normal([0.0, 0.0], [[1.0, b], [b, 1.0]]).cdf([a, a])
            for a, b in zip(z, r, strict=True)
        ]
    )
    near = z > -4.0
    assert near.sum() > 5
    np.testing.assert_allclose(first, norm.logcdf(z), rtol=1e-6)
    expected = both - norm.cdf(z) ** 2
    np.testing.assert_allclose(np.exp(log_variance)[near], expected[near], rtol=0.03, atol=1e-7)


def test_moments_are_finite_however_far_the_threshold():
    for threshold in (-1e3, -1e30, 1e30):
        first, variance = log_moments(fitted(noise=0.1, rule=threshold), GRID[::40])
        assert np.isfinite(first).all()
        assert np.isfinite(variance).all()


class Known(Surrogate):
    """A Gaussian likelihood that is known."""

    u, centre, sd = np.zeros((9, 2)), np.array([0.4, 0.6]), np.array([0.1, 0.02])
    predict = fantasize = best = None  # a rule that draws needs none

    def log_likelihood(self, u):
        return -0.5 * np.sum(((u - self.centre) / self.sd) ** 2, axis=1)


def test_draws_follow_the_posterior():
    """Means of 150 draws to five of their errors, the sd of both coordinates to four."""
    rule = in_float64(inference.PosteriorDraws(share=1.0))  # as the engine calls it
    drawn = np.concatenate([rule(jax.random.key(i), Known(), 1) for i in range(150)])
    z = (drawn - Known.centre) / Known.sd
    assert (np.abs(z.mean(0)) < 5.0 / np.sqrt(150)).all()
    assert abs(z.std() - 1.0) < 4.0 / np.sqrt(600)


def test_expected_variance_prefers_where_a_run_teaches():
    """Beside many runs at one point, another there resolves next to nothing."""
    centre = np.array([0.4, 0.4])
    u = np.concatenate([sobol(0, 0, 9, 2), np.tile(centre, (12, 1))])
    rng = np.random.default_rng(0)
    values = 1.0 + ((u - 0.4) ** 2).sum(-1) + 0.02 * rng.normal(size=len(u))
    surrogate = learn(u, values, "identity")
    chosen = RULES["eiv"]()(KEY, surrogate, 1)[0]
    assert np.linalg.norm(chosen - centre) > 0.05


def test_regions_where_runs_fail_are_avoided():
    surrogate = fitted(24, noise=0.05)
    good = surrogate.gp.data.u
    bad = np.random.default_rng(0).normal([0.4, 0.4], 0.05, (24, 2))
    u, succeeded = np.concatenate([good, bad]), np.arange(48) < 24
    success = learn_success(RunOutcomes(u, succeeded), None)
    assert log_success(success, np.array([[0.4, 0.4]]))[0] < -1.5
    assert log_success(success, np.array([[0.95, 0.95]]))[0] > -0.3
    failing = replace(surrogate, success=success)

    def among_failures(rule, of):
        points = np.concatenate([in_float64(rule)(jax.random.key(k), of, 4) for k in range(4)])
        return (np.linalg.norm(points - 0.4, axis=1) < 0.1).sum()

    for name in ("lcb", "draws", "eiv"):  # the others are made of these
        seen, unseen = (among_failures(RULES[name](), of) for of in (failing, surrogate))
        assert 4 * seen < unseen, name
