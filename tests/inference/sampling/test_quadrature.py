"""Adaptive quadrature against closed forms and a dense grid."""

from functools import partial

import numpy as np
import pytest
from bolfi_liquids.inference._float64 import in_float64
from bolfi_liquids.inference.gp.namespaces import log_sum_exp
from bolfi_liquids.inference.sampling import quadrature
from bolfi_liquids.inference.sampling.target import Target
from scipy.stats import chisquare, norm

integrate = in_float64(quadrature.integrate)
ALPHA = 1e-4  # false alarms per test


def peaks(state, u):
    """Two Gaussians of weight 0.8 and 0.2."""
    centres, sds = state
    z = (u[:, None] - centres) / sds
    logs = np.log([0.8, 0.2]) - np.sum(0.5 * z**2 + np.log(sds * np.sqrt(2.0 * np.pi)), -1)
    return log_sum_exp(logs)


def banana(u):
    x, y = 8.0 * (u.T - 0.5)
    return -0.5 * (x / 1.5) ** 2 - 0.5 * ((y - 0.5 * x**2 + 1.0) / 0.3) ** 2


def holes(u):
    """NaN on the left, -inf below."""
    with np.errstate(invalid="ignore"):
        return np.where(u[:, 1] < 0.5, -np.inf, np.sqrt(u[:, 0] - 0.5) * 0.0)


def moments(cells):
    """Mean and sd of u [d]."""
    centre = cells.low + 0.5 * cells.width[:, None]
    mean = cells.mass @ centre
    return mean, np.sqrt(cells.mass @ ((centre - mean) ** 2 + cells.width[:, None] ** 2 / 12))


def marginal(cells, j, edges):
    """Probability of u_j between consecutive edges."""
    below = (edges - cells.low[:, j, None]) / cells.width[:, None]
    return np.diff(cells.mass @ np.clip(below, 0.0, 1.0))


def target(d, sd, apart=True):
    centres = np.stack([np.full(d, 0.31), np.full(d, 0.72 if apart else 0.31)])
    return Target(partial(peaks, (centres, np.full((2, d), sd))), d)


@pytest.mark.parametrize(("d", "sd"), [(1, 0.002), (2, 0.05), (2, 0.002)])
def test_moments_of_a_peak(d, sd):
    cells = integrate(target(d, sd, apart=False))
    found = moments(cells)
    np.testing.assert_allclose(found[0], 0.31, atol=0.01 * sd)
    np.testing.assert_allclose(found[1], sd, rtol=0.01)
    assert len(cells.mass) <= quadrature.QUICK_BUDGET
    assert cells.mass @ np.ones(len(cells.mass)) == pytest.approx(1.0)
    np.testing.assert_allclose(np.sum(cells.width**d), 1.0)  # cells fill the box


@pytest.mark.parametrize(("d", "sd"), [(1, 0.05), (2, 0.002)])
def test_marginals_with_two_separate_modes(d, sd):
    cells = integrate(target(d, sd))
    edges = np.concatenate([[0.0], 0.31 + sd * np.linspace(-2.0, 2.0, 9), [0.5, 1.0]])
    exact = 0.8 * np.diff(norm.cdf(edges, 0.31, sd)) + 0.2 * np.diff(norm.cdf(edges, 0.72, sd))
    np.testing.assert_allclose(marginal(cells, 0, edges), exact, atol=2e-3)


def test_agrees_with_a_dense_grid_on_a_banana():
    cells = integrate(Target(banana, 2))
    axis = (np.arange(2000) + 0.5) / 2000
    x, y = np.meshgrid(8.0 * (axis - 0.5), 8.0 * (axis - 0.5), indexing="ij")
    density = np.exp(-0.5 * (x / 1.5) ** 2 - 0.5 * ((y - 0.5 * x**2 + 1.0) / 0.3) ** 2)
    exact = (density.sum(0) / density.sum()).reshape(20, -1).sum(1)
    np.testing.assert_allclose(marginal(cells, 1, np.linspace(0.0, 1.0, 21)), exact, atol=2e-3)


def test_what_is_not_finite_has_no_mass():
    cells = integrate(Target(holes, 2))
    np.testing.assert_allclose(moments(cells)[0], 0.75, atol=1e-3)


def test_draws_follow_the_cells_and_a_shift_is_noticed():
    """Shifted by 0.2 sd: 4000 draws in 16 bins notice with near certainty."""
    cells = integrate(target(1, 0.05))
    u, _ = quadrature.draw(np.random.default_rng(0), cells, 4000)
    expected = marginal(cells, 0, np.linspace(0.2, 0.42, 12))
    shares = expected / expected.sum()
    for shift, passes in ((0.0, True), (0.01, False)):
        counts = np.histogram(u[:, 0] + shift, np.linspace(0.2, 0.42, 12))[0]
        assert (chisquare(counts, shares * counts.sum()).pvalue > ALPHA) is np.bool_(passes)


@pytest.mark.parametrize("d", [1, 2])
def test_total_variation_passes_independent_draws_and_fails_wrong_ones(d):
    """Twenty sets of 1000 independent draws; then sd 30 % too small, and a lost mode."""
    cells = integrate(target(d, 0.05))
    rng = np.random.default_rng(0)
    limit = quadrature.largest_expected(1000)

    def exact(n, share=0.8, sd=0.05):
        low = rng.random((n, 1)) < share
        return np.where(low, 0.31, 0.72) + sd * rng.normal(size=(n, d))

    distances = [quadrature.total_variation(exact(1000), cells) for _ in range(20)]
    assert max(distances) < limit
    assert np.mean(distances) < 0.5 * limit
    many = quadrature.draw(rng, cells, 10**5)[0]  # independent ones: 0.005
    assert quadrature.total_variation(many, cells) < 0.013
    assert quadrature.total_variation(exact(1000, share=1.0), cells) > limit
    assert quadrature.total_variation(exact(4000, sd=0.03), cells) > quadrature.largest_expected(
        4000
    )


def test_three_parameters_are_refused():
    with pytest.raises(ValueError, match="one or two parameters, got 3"):
        integrate(target(3, 0.1))
