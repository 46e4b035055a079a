"""Two views joined, against directions in space whose pictures are worked out here."""

import dataclasses

import numpy as np
import pytest
from bolfi_liquids.hardware.rendering import direction as down_direction
from bolfi_liquids.hardware.vision import (
    Flag,
    FrameMeasurement,
    MeasuredView,
    ViewLines,
    direction,
    frame_series,
    inclination,
    interpolate_lines,
    join,
    look_at,
)
from rendered_scenes import rehearsal_camera

ERROR = 2e-4


def lines_of(camera, inclinations, pivots) -> ViewLines:
    """Slope and offset through the pictures of two points of the stick."""
    angle, offset = [], []
    for inclination_, pivot in zip(inclinations, pivots, strict=True):
        points = pivot + np.outer([0.02, 0.2], down_direction(inclination_))
        x, y, z = camera.to_camera(points).T
        slope = float(np.diff(x / z)[0] / np.diff(y / z)[0])
        angle.append(np.arctan(slope))
        offset.append((x / z - slope * y / z)[0])
    error = np.full(len(angle), ERROR)
    return ViewLines(
        np.array(angle), np.array(offset), error, error / 10, np.zeros(len(angle), int)
    )


@pytest.fixture
def scenes():
    rng = np.random.default_rng(0)
    pivots = np.column_stack([rng.uniform(-0.025, 0.025, (50, 2)), np.full(50, 0.235)])
    return np.radians(rng.uniform(-45, 45, (50, 2))), pivots


def yawed(view: str, yaw_deg: float, roll_deg: float = 1.0):
    camera = rehearsal_camera(view)
    turn, (x, y, z) = np.radians(yaw_deg), camera.position
    cos, sin = np.cos(turn), np.sin(turn)
    position = np.array([cos * x - sin * y, sin * x + cos * y, z])
    rotation = look_at(position, np.array([0.0, 0.0, 0.13]), np.radians(roll_deg))
    return dataclasses.replace(camera, position=position, rotation=rotation)


def test_two_exact_lines_give_the_direction_in_space(scenes):
    inclinations, pivots = scenes
    cameras = yawed("xz", 3.0), yawed("yz", -4.0)
    lines = [lines_of(camera, inclinations, pivots) for camera in cameras]
    expected = np.array([down_direction(i) for i in inclinations])
    np.testing.assert_allclose(direction(*lines, *cameras), expected, atol=1e-10)
    np.testing.assert_allclose(inclination(*lines, *cameras).angle, inclinations, atol=1e-10)


def test_standard_errors_are_those_of_many_draws(scenes):
    inclinations, pivots = scenes
    cameras = rehearsal_camera("xz"), rehearsal_camera("yz")
    exact = [lines_of(camera, inclinations, pivots) for camera in cameras]
    rng, drawn = np.random.default_rng(1), []
    for _ in range(400):
        noisy = [
            line._replace(
                angle=line.angle + rng.normal(0, line.angle_error),
                offset=line.offset + rng.normal(0, line.offset_error),
            )
            for line in exact
        ]
        drawn.append(inclination(*noisy, *cameras).angle)
    spread = np.std(drawn, axis=0)
    ratio = inclination(*exact, *cameras).error / spread
    # 400 draws tell a standard deviation to 3.5 %; the largest of 100 lies within 4 of these
    np.testing.assert_allclose(ratio, 1.0, atol=0.15)


def as_series(frames):
    columns = np.array(frames, dtype=float).reshape(-1, len(FrameMeasurement._fields)).T
    return frame_series(dict(zip(FrameMeasurement._fields, columns, strict=True)))


def frame(k: int, stamp: float, angle: float, flags: int = 0) -> FrameMeasurement:
    nothing = float("nan")
    return FrameMeasurement(
        index=k,
        stamp=stamp,
        marker_column=nothing,
        marker_row=nothing,
        angle=angle,
        offset=0.1 * angle,
        angle_error=ERROR,
        offset_error=ERROR,
        second_angle=angle,
        rows=200,
        flags=flags,
    )


def cubic(time):
    return 0.1 + 0.3 * time - 0.5 * time**2 + 2.0 * time**3


def test_interpolation_is_exact_for_cubics_and_passes_over_flagged_frames():
    stamps = np.sort(np.random.default_rng(0).normal(np.arange(40) / 30, 0.003))
    frames = [frame(k, t, cubic(t)) for k, t in enumerate(stamps)]
    frames[17] = frame(17, stamps[17], 1.5, Flag.JUMP)
    frames[25] = frame(25, stamps[25], cubic(stamps[25]), Flag.NO_MARKER)
    wanted = np.linspace(stamps[3], stamps[-4], 200)
    found = interpolate_lines(as_series(frames), wanted)
    np.testing.assert_allclose(found.angle, cubic(wanted), atol=1e-9)
    np.testing.assert_allclose(found.offset, 0.1 * cubic(wanted), atol=1e-9)
    assert (found.flags == 0).all()
    # at a frame its own value and error return
    again = interpolate_lines(as_series(frames), stamps[:10])
    np.testing.assert_allclose(again.angle, cubic(stamps[:10]))
    np.testing.assert_allclose(again.angle_error, ERROR)


def test_errors_between_frames_are_those_of_many_draws():
    rng, stamps, wanted = np.random.default_rng(3), np.arange(12) / 30, np.array([0.18, 0.2])
    drawn = []
    for _ in range(600):
        noise = rng.normal(0, ERROR, 12)
        series = as_series([frame(k, t, noise[k]) for k, t in enumerate(stamps)])
        found = interpolate_lines(series, wanted)
        drawn.append(found.angle)
    np.testing.assert_allclose(np.std(drawn, axis=0), found.angle_error, rtol=0.12)


def test_long_gaps_and_times_outside_have_no_value_but_a_reason():
    frames = [frame(k, k / 30, 0.1, Flag.FEW_ROWS if 10 <= k < 14 else 0) for k in range(30)]
    found = interpolate_lines(as_series(frames), np.array([-0.1, 0.2, 12 / 30, 0.9, 1.5]))
    np.testing.assert_array_equal(np.isnan(found.angle), [True, False, True, False, True])
    assert found.flags[[1, 3]].tolist() == [0, 0]
    assert Flag(int(found.flags[2])) == Flag.GAP | Flag.FEW_ROWS
    assert Flag.GAP in Flag(int(found.flags[0])) and Flag.GAP in Flag(int(found.flags[4]))


def test_a_second_neighbour_beyond_a_gap_does_not_count():
    stamps, angles = [0.0, 0.2, 7 / 30, 8 / 30, 0.3], [1.0, 0.2, 7 / 30, 8 / 30, 0.3]
    for sign in (1.0, -1.0):  # before the gap and after it
        rows = sorted((sign * stamp, angle) for stamp, angle in zip(stamps, angles, strict=True))
        series = as_series([frame(k, *row) for k, row in enumerate(rows)])
        found = interpolate_lines(series, np.array([sign * 0.21]))
        assert found.angle == pytest.approx([0.21])


def test_no_frames_give_no_values():
    for count in (0, 1):
        frames = [frame(k, k / 30, 0.1) for k in range(count)]
        found = interpolate_lines(as_series(frames), np.array([0.0, 0.1]))
        assert np.isnan(found.angle).all() and (found.flags == Flag.GAP).all()


def test_cameras_out_of_step_are_joined_at_times_of_the_robot():
    def truth(time):
        return np.radians(np.column_stack([10 * np.sin(7 * time), 8 * np.sin(9 * time + 1)]))

    def view(name, delay, stamps, yaw_deg):
        camera = yawed(name, yaw_deg)
        inclinations = truth(stamps - delay)
        lines = lines_of(camera, inclinations, np.tile([0.01, 0.0, 0.235], (len(stamps), 1)))
        frames = [
            frame(k, t, lines.angle[k])._replace(offset=lines.offset[k])
            for k, t in enumerate(stamps)
        ]
        return MeasuredView(as_series(frames), delay, camera)

    views = (
        view("xz", 0.03, 500.03 + np.arange(90) / 30, 2.0),
        view("yz", 0.08, 500.091 + np.arange(90) / 30, -1.0),
    )
    times = np.linspace(500.2, 502.8, 79)
    joined = join(*views, times)
    assert (joined.flags == 0).all()
    assert np.degrees(np.abs(joined.angle - truth(times)).max()) < 0.05
    # taking both cameras' delays for one is far worse
    late = views[1]._replace(delay=0.03)
    assert np.degrees(np.abs(join(views[0], late, times).angle - truth(times)).max()) > 1.0
