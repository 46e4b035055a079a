"""Analysis on data made up from known answers."""

import numpy as np
import pytest
from analysis import motion, shapes


def lattice(*counts):
    axes = [np.arange(n) - (n - 1) / 2 for n in counts]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def test_front_and_height_leave_out_spray():
    block = 0.01 * (lattice(6, 4, 8) + [2.5, 1.5, 3.5] + 0.5)
    spray = np.array([[1.0, 0, 0.9], [0.9, 0, 0.8]])
    both = np.stack([np.concatenate([block, spray])] * 2)
    np.testing.assert_allclose(shapes.front_position(both, 0.01, strays=2), 0.06)
    np.testing.assert_allclose(shapes.column_height(block, 0.01, 0.03), 0.08)
    np.testing.assert_allclose(shapes.column_height(both, 0.01, 0.03), [0.08, 0.08])
    assert np.isnan(shapes.column_height(block + 1.0, 0.01, 0.03))
    with pytest.raises(ValueError, match="no front"):
        shapes.front_position(block[:2], 0.01)


def test_speeds_are_means_of_their_squares():
    velocity = np.zeros((2, 4, 3))
    velocity[1, :, 0], velocity[1, :, 2] = 3.0, 4.0
    np.testing.assert_allclose(motion.rms_speed(velocity), [0, 5])


@pytest.mark.parametrize("decay", [0.0, 0.6])
def test_period_and_decay_of_a_swing(decay):
    time = np.arange(0, 4, 1 / 240)
    signal = 0.2 + 0.1 * np.exp(-decay * time) * np.cos(2 * np.pi * time / 0.63 + 0.4)
    swing = motion.oscillation(time, signal, 0.2)
    assert swing.period == pytest.approx(0.63, rel=1e-3)
    assert swing.decay == pytest.approx(decay, abs=0.01)


def test_a_signal_that_does_not_swing_is_refused():
    with pytest.raises(ValueError, match="3 passages"):
        motion.oscillation(np.arange(9.0), np.arange(9.0) - 4)


@pytest.mark.parametrize("decay", [0.0, 1.5])
def test_the_far_side_of_a_swing(decay):
    time = 0.5 + np.arange(0, 2, 1 / 240)
    angle = 2 * np.pi * (time - 0.5) / 0.7
    start = np.cos(angle) + decay * 0.7 / (2 * np.pi) * np.sin(angle)  # released at rest
    signal = 0.1 - 0.3 * np.exp(-decay * (time - 0.5)) * start
    far = motion.far_side(time, signal, 0.1)
    assert far.time == pytest.approx(0.35, abs=1 / 240)
    assert far.ratio == pytest.approx(np.exp(-decay * 0.35), rel=1e-3)


def test_an_overdamped_swing_has_no_far_side():
    far = motion.far_side(np.arange(9.0), np.exp(-np.arange(9.0)))
    assert np.isnan(far.time) and np.isnan(far.ratio)
