"""Delays of cameras from the marker, against known ones."""

import dataclasses

import numpy as np
import pytest
from bolfi_liquids.hardware.cameras import RenderedCamera, Timing
from bolfi_liquids.hardware.motion import Trajectory, star
from bolfi_liquids.hardware.rendering import Look, prepare
from bolfi_liquids.hardware.vision import (
    DelayError,
    FrameMeasurement,
    FrameMeter,
    FrameSeries,
    MeasuredView,
    ViewLines,
    fit_delay,
    frame_series,
    join,
)
from rendered_scenes import MovingWorld, rehearsal_camera, rehearsal_scene, stick_view
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation
from stepped_clock import SteppedClock

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


def inclination_of(time):
    return np.radians([8 * np.sin(6.9 * time) + 3 * np.sin(2.3 * time), 7 * np.sin(8.1 * time + 1)])


def filmed(view: str, timing: Timing, frames: int):
    """Measurements of a rendered stir; robot's clock minus the computer's is START - 50."""
    world = MovingWorld(pivot, inclination_of, offset=START - 50.0)
    scene, camera = rehearsal_scene(view), rehearsal_camera(view)
    rendered = RenderedCamera(
        prepare(scene, camera, Look(), seed=timing.seed),
        world,
        timing,
        clock=SteppedClock(50.0),
    )
    meter, found = FrameMeter(stick_view(scene, camera)), []
    for _ in range(frames):
        frame = rendered.read()
        assert frame is not None
        found.append(meter.measure(frame))
    columns = dict(zip(FrameMeasurement._fields, np.array(found).T, strict=True))
    return frame_series(columns), camera, scene.marker_offset


def joined_from_pictures(frames: int):
    """Joined inclination, times, and errors of both delays [s]."""
    timings = {
        "xz": Timing(seed=1),
        "yz": Timing(seed=2, rate=29.97, latency=0.08),
    }
    robot, views, late = samples(125.0), [], []
    for name, timing in timings.items():
        series, camera, marker = filmed(name, timing, frames)
        series = series._replace(stamp=series.stamp + START - 50.0)
        delay = fit_delay(series, robot, camera, marker).delay
        late.append(delay - timing.latency)
        views.append(MeasuredView(series, delay, camera))
    times = START + np.arange(0.2, frames / 30 - 0.2, 1 / 30)
    return join(views[0], views[1], times), times, np.array(late)


def check_joined(joined, times, late) -> None:
    errors = joined.angle - np.array([inclination_of(time) for time in times])
    good = joined.flags == 0
    np.testing.assert_array_equal(np.isfinite(errors).all(axis=1), good)
    assert good.mean() > 0.75
    assert np.degrees(np.sqrt(np.mean(errors[good] ** 2))) < 0.15
    assert np.degrees(np.abs(errors[good]).max()) < 3.0
    assert 0.7 < np.sqrt(np.mean((errors[good] / joined.error[good]) ** 2)) < 1.4
    assert np.abs(late).max() < 3e-4


@pytest.mark.slow
def test_a_stir_is_recovered_from_its_pictures():
    check_joined(*joined_from_pictures(200))
