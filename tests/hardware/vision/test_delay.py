"""Delays of cameras from the marker, against known ones."""

import dataclasses

import numpy as np
import pytest
from bolfi_liquids.hardware.motion import Trajectory, star
from bolfi_liquids.hardware.vision import (
    DelayError,
    FrameSeries,
    ViewLines,
    fit_delay,
)
from rendered_scenes import rehearsal_camera, rehearsal_scene
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

cv2 = pytest.importorskip("cv2")

START = 700.0  # s, of the robot's clock
PATH = star(speed=0.1, height=0.235, rest=1.0, rate=500.0)
DURATION = float(PATH.time[-1])
DELAY = 0.07  # s
MARKER = rehearsal_scene("xz").marker_offset
_spline = CubicSpline(PATH.time, PATH.position)


def pivot(time):
    """Where the gripper is at times of the robot's clock."""
    return _spline(np.clip(time - START, 0.0, DURATION))


def samples(rate: float) -> Trajectory:
    time = START + np.arange(0.0, DURATION, 1.0 / rate)
    return Trajectory(time, pivot(time))


def marker_series(camera, noise: float, seed: int = 0, delay: float = DELAY) -> FrameSeries:
    """What a camera would see, without pictures."""
    rng = np.random.default_rng(seed)
    exposed = START + np.arange(0.0, DURATION, 1 / 30)
    pixels = camera.project(pivot(exposed) + np.array(MARKER))
    pixels += rng.normal(0.0, noise, pixels.shape)
    nothing = np.full(len(exposed), np.nan)
    flags = np.zeros(len(exposed), int)
    return FrameSeries(exposed + delay, pixels, ViewLines(*[nothing] * 4, flags))


@pytest.mark.parametrize(("rate", "delay"), [(125.0, 0.03), (30.0, 0.4), (125.0, -0.3)])
def test_the_delay_is_found(rate, delay):
    camera = rehearsal_camera("xz")
    series = marker_series(camera, noise=0.05, delay=delay)
    found = fit_delay(series, samples(rate), camera, MARKER)
    assert found.delay == pytest.approx(delay, abs=3e-4)
    assert found.residual == pytest.approx(0.05, rel=0.3)


def test_standard_errors_of_the_delay_are_those_of_many_recordings():
    camera, normalised = rehearsal_camera("yz"), []
    for seed in range(40):
        series = marker_series(camera, noise=0.1, seed=seed)
        found = fit_delay(series, samples(125.0), camera, MARKER)
        normalised.append((found.delay - DELAY) / found.error)
    # the scatter of 40 draws lies within 0.65 and 1.4 of the truth with probability 0.999
    assert 0.65 < np.sqrt(np.mean(np.square(normalised))) < 1.4


def test_frames_with_another_marker_do_not_move_the_delay():
    camera = rehearsal_camera("xz")
    series = marker_series(camera, noise=0.05)
    series.marker[::9] += [40.0, -25.0]
    series.marker[5::11] = np.nan
    found = fit_delay(series, samples(125.0), camera, MARKER)
    assert found.delay == pytest.approx(DELAY, abs=5e-4)


def test_a_camera_that_was_moved_is_told_by_the_misfit_and_does_not_shift_the_delay():
    camera = rehearsal_camera("xz")
    series = marker_series(camera, noise=0.05)
    turn = Rotation.from_rotvec(-np.radians([0.2, 2.0, 0.5])).as_matrix()
    moved = dataclasses.replace(
        camera,
        rotation=turn @ camera.rotation,
        position=camera.position + np.array([0.005, 0.01, 0.0]),
    )
    found = fit_delay(series, samples(125.0), moved, MARKER)
    assert found.delay == pytest.approx(DELAY, abs=5e-4)
    assert found.misfit > 10.0 > 20 * found.residual


def test_pictures_that_tell_nothing_about_time_are_refused():
    camera = rehearsal_camera("xz")
    series = marker_series(camera, noise=0.05)
    robot = samples(125.0)
    with pytest.raises(DelayError, match="show the marker"):
        fit_delay(series._replace(stamp=series.stamp + 100.0), robot, camera, MARKER)
    hidden = series._replace(marker=np.full_like(series.marker, np.nan))
    with pytest.raises(DelayError, match="only 0 frames"):
        fit_delay(hidden, robot, camera, MARKER)
    still = Trajectory(robot.time, np.tile(robot.position[0], (len(robot.time), 1)))
    with pytest.raises(DelayError, match="hardly moves"):
        fit_delay(series, still, camera, MARKER)
    lost = Trajectory(robot.time, np.full_like(robot.position, np.nan))
    with pytest.raises(DelayError, match="0 finite samples"):
        fit_delay(series, lost, camera, MARKER)
