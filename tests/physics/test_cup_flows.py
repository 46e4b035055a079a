"""Truths about liquid in a cup, on something else than the cases."""

import numpy as np
import pytest
from scipy.special import jn_zeros, jv, jvp
from truths import cup_flows

R, NU = 0.04, 1e-3
r = np.linspace(1e-4, R, 400)


def spun_up(time, angular_velocity):
    """Speed in a long cylinder that started to turn at time 0 (Batchelor 1967, section 4.5)."""
    zeros = jn_zeros(1, 200)
    modes = 2.0 * angular_velocity * R * jv(1, np.outer(r / R, zeros)) / (zeros * jv(0, zeros))
    return angular_velocity * r + modes @ np.exp(-NU * (zeros / R) ** 2 * time)


def test_the_slowest_swirl_is_what_spinning_up_ends_with():
    short = np.stack([r - spun_up(late, 1.0) for late in (0.2, 0.3)])
    rate = np.log(short[0, 10:-10] / short[1, 10:-10]) / 0.1
    np.testing.assert_allclose(rate, cup_flows.swirl_decay(R, NU), rtol=0.02)
    ratio = short[1][10:-10] / cup_flows.swirl_mode(r, R)[10:-10]
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=0.02)
    assert cup_flows.swirl_mode(r, R).max() == pytest.approx(1.0, abs=1e-4)


def test_implicit_steps_decay_slower():
    assert cup_flows.implicit_rate(1e-3, 1.0) == pytest.approx(1e-3, rel=1e-3)
    assert np.exp(-cup_flows.implicit_rate(50.0, 0.02) * 0.02) == pytest.approx(0.5)


def test_a_force_like_the_radius_drives_a_cubic():
    ours = cup_flows.driven_swirl(r, lambda x: 3.0 * x, R, NU)
    np.testing.assert_allclose(ours, 3.0 / (8 * NU) * (R**2 * r - r**3), atol=1e-5 * ours.max())


def test_a_thin_ring_turns_what_is_within_and_drags_the_rest():
    """Torque 2π r0² F is that between cylinders, 4π ν w r0² R² / (R² - r0²)."""
    at, wide = 0.02, 2e-4
    ours = cup_flows.driven_swirl(r, lambda x: np.exp(-(((x - at) / wide) ** 2)), R, NU)
    inner, outer = r < 0.9 * at, r > 1.1 * at
    turn = np.sqrt(np.pi) * wide * (R**2 - at**2) / (2 * NU * R**2)
    np.testing.assert_allclose(ours[inner], turn * r[inner], rtol=2e-2)
    between = turn * at**2 / (R**2 - at**2) * (R**2 / r - r)
    np.testing.assert_allclose(ours[outer], between[outer], rtol=2e-2, atol=1e-6)


def test_sloshing_meets_no_wall_and_flows_from_a_potential():
    period = cup_flows.sloshing_period(R, 0.05)
    assert period == pytest.approx(0.298, rel=5e-3)  # k = 46 /m, tanh 0.98
    angle = np.linspace(0.1, 6.0, 7)
    wall = np.stack([R * np.cos(angle), R * np.sin(angle), np.full(7, 0.03)], axis=1)
    u = cup_flows.sloshing_velocity(wall, R, 0.05)
    outward = (u[:, :2] * wall[:, :2]).sum(axis=1) / R
    np.testing.assert_allclose(outward, 0.0, atol=1e-6)
    np.testing.assert_allclose(cup_flows.sloshing_velocity(wall * [1, 1, 0], R, 0.05)[:, 2], 0.0)
    middle = cup_flows.sloshing_velocity(np.array([[1e-6, 0.0, 0.05]]), R, 0.05)
    np.testing.assert_allclose(middle, [[1.0, 0.0, 0.0]], atol=1e-4)
    points, step = np.random.default_rng(0).uniform(-0.02, 0.02, (6, 3)), 1e-5
    divergence = sum(
        (
            cup_flows.sloshing_velocity(points + step * e, R, 0.05)
            - cup_flows.sloshing_velocity(points - step * e, R, 0.05)
        )
        @ e
        for e in np.eye(3)
    ) / (2 * step)
    np.testing.assert_allclose(divergence, 0.0, atol=1e-3)
    assert jvp(1, 1.8412) == pytest.approx(0.0, abs=1e-4)
