import jax
import numpy as np
import pytest
from bolfi_liquids.inference.acquisition import (
    LCBState,
    exploration_width,
    lower_confidence_bound,
    truncated_normal,
)
from bolfi_liquids.inference.design import sobol
from bolfi_liquids.inference.surrogate import learn
from scipy.stats import kstest, qmc, truncnorm

from bolfi_liquids import inference


def test_start_design_fills_the_box_and_continues():
    points = sobol(0, 0, 32, 2)
    np.testing.assert_array_equal(sobol(0, 5, 9, 2), points[5:9])
    random = np.random.default_rng(0).uniform(size=(32, 2))
    assert qmc.discrepancy(points) < 0.5 * qmc.discrepancy(random)
    assert not np.allclose(points, sobol(1, 0, 32, 2))


def test_width_follows_the_papers_schedule():
    expected = np.sqrt(2 * np.log(20.0**3 * np.pi**2 / 0.3))
    np.testing.assert_allclose(exploration_width(20, 2), expected)


def test_minimises_mean_less_width_times_latent_sd():
    u = sobol(0, 0, 12, 2)
    fitted = learn(u, 1.0 + ((u - 0.4) ** 2).sum(-1), transform="identity")
    chosen = inference.LowerConfidenceBound(jitter=1e-6)(jax.random.key(0), fitted, 1)
    axis = np.linspace(0.0, 1.0, 41)
    grid = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    with jax.enable_x64(True):
        state = LCBState(fitted.gp, jax.numpy.asarray(exploration_width(12, 2)))
        bound = jax.vmap(lower_confidence_bound, (None, 0))
        assert bound(state, chosen)[0] <= bound(state, grid).min() + 1e-4


def test_jitter_is_a_truncated_normal():
    with jax.enable_x64(True):
        keys = jax.random.split(jax.random.key(0), 500)
        points = np.array([truncated_normal(k, np.array([0.02]), 0.05)[0] for k in keys])
    expected = truncnorm(-0.4, 19.6, loc=0.02, scale=0.05)
    assert kstest(points, expected.cdf).pvalue > 1e-4
    assert kstest(points, truncnorm(-0.2, 9.8, loc=0.02, scale=0.1).cdf).pvalue < 1e-4


def test_belief_alone_separates_the_points_of_a_batch():
    u = sobol(0, 0, 9, 2)
    rng = np.random.default_rng(0)
    fitted = learn(u, 1.0 + ((u - 0.4) ** 2).sum(-1) + 0.1 * rng.normal(size=9))
    batch = inference.LowerConfidenceBound(jitter=1e-6)(jax.random.key(0), fitted, 4)
    distances = np.linalg.norm(batch[:, None] - batch, axis=-1) + np.eye(4)
    assert distances.min() > 0.02


def test_jitter_keeps_points_off_the_bounds():
    """The least discrepancy lies in a corner, where every minimiser ends."""
    u = sobol(0, 0, 9, 2)
    fitted = learn(u, 1.0 + u.sum(-1))
    batch = inference.LowerConfidenceBound()(jax.random.key(0), fitted, 8)
    assert np.median(np.minimum(batch, 1.0 - batch).min(-1)) > 1e-3


def test_jitter_must_be_positive():
    with pytest.raises(ValueError, match="jitter must be positive"):
        inference.LowerConfidenceBound(jitter=0.0)
