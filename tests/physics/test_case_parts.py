"""What cases compute beside their simulation."""

import numpy as np
import pytest
from cases import _stirring, seed_noise


def test_a_pivot_at_rest_stays_on_the_axis():
    path = _stirring.resting(0.15, 0.5, 60.0)
    assert path.position.shape == (31, 3) and path.time[-1] == pytest.approx(0.5)
    np.testing.assert_array_equal(path.position, [[0.0, 0.0, 0.15]] * 31)


def test_tilt_is_the_angle_between_vectors():
    rng = np.random.default_rng(0)
    direction = rng.normal(size=(20, 3))
    direction[:, 2] = -np.abs(direction[:, 2])
    signal = np.arctan2(direction[:, :2], -direction[:, 2:])
    expected = np.arccos(-direction[:, 2] / np.linalg.norm(direction, axis=1))
    np.testing.assert_allclose(_stirring.tilt(signal), expected)


def test_strokes_keep_their_speed_and_stay_in_the_cup():
    time, position = seed_noise.strokes()
    speed = np.abs(np.diff(position[:, 0])) / np.diff(time)
    assert np.median(speed) == pytest.approx(seed_noise.SPEED)
    assert np.abs(position[:, 0]).max() <= seed_noise.STROKE
    assert position[0, 0] == pytest.approx(0.0, abs=1e-12)


def test_spread_is_the_noise_put_in():
    rng = np.random.default_rng(1)
    signals = np.linspace(-5, 5, 400)[:, None] + 0.3 * rng.standard_normal((8, 400, 2))
    assert seed_noise.spread(signals) == pytest.approx(0.3, rel=0.03)
