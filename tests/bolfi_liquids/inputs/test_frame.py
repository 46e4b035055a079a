"""Frames that are turned or mirrored are found, and those that are not are let pass."""

from dataclasses import replace

import numpy as np
import pytest

from bolfi_liquids.inputs.bundled import RECORDED_LIQUIDS, bundled_recording
from bolfi_liquids.inputs.frame import MAX_TURN_DEG, found_turn, frame_faults, recording_warnings
from bolfi_liquids.inputs.recording import Trajectory

PASSING, SHORT = "glycerin", 60


def seen_as(recording, change):
    """A recording whose inclination, as a complex number, was changed."""
    changed = change(recording.inclination[:, 0] + 1j * recording.inclination[:, 1])
    return replace(recording, inclination=np.column_stack([changed.real, changed.imag]))


def turned(recording, angle_deg):
    return seen_as(recording, lambda seen: np.exp(1j * np.radians(angle_deg)) * seen)


def moving(recording, x, y):
    """The recording with another path, and a stick that trails it by 0.1 s."""
    z = recording.gripper.position[:, 2]
    path = np.column_stack([x, y, z])
    late = [np.interp(recording.time - 0.1, recording.time, axis) for axis in (x, y)]
    return replace(
        recording,
        gripper=Trajectory(recording.time, path),
        inclination=-4.0 * np.column_stack(late),
    )


def _without_start(recording, count):
    time, way = recording.time[count:], recording.gripper.position[count:]
    kept = {"inclination": recording.inclination[count:], "time": time}
    return replace(recording, gripper=Trajectory(time, way), **kept)


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
def test_what_was_recorded_in_one_frame_passes(liquid):
    recording = bundled_recording(liquid)
    for one in (recording, recording.first(SHORT), recording.first(recording.time.size // 2)):
        assert list(frame_faults(one)) == []
    assert recording_warnings([recording]) == []


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
@pytest.mark.parametrize("angle_deg", [0.0, 10.0, -30.0, 45.0, 90.0, 180.0])
def test_a_turn_is_measured(liquid, angle_deg):
    recording = bundled_recording(liquid)
    usual, found = found_turn(recording), found_turn(turned(recording, angle_deg))
    assert usual is not None and found is not None
    apart = (found.angle_deg - usual.angle_deg - angle_deg + 180.0) % 360.0 - 180.0
    assert abs(apart) < 1e-6
    assert found.error_deg < 3.0 and not found.mirrored


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda seen: np.exp(0.25j * np.pi) * seen, ("yaw_deg",)),
        (lambda seen: 1j * seen, ("yaw_deg",)),
        (lambda seen: -seen, ("inclination_xz", "inclination_yz", "flip")),
        (np.conj, ("inclination_yz", "flip")),
        (lambda seen: -np.conj(seen), ("inclination_xz", "flip")),
        (lambda seen: 1j * np.conj(seen), ("exchanged",)),
        (lambda seen: np.exp(0.25j * np.pi) * np.conj(seen), ("mirrored", "flip", "yaw_deg")),
    ],
    ids=["45 deg", "90 deg", "both signs", "yz", "xz", "exchanged", "mirrored and 45 deg"],
)
def test_each_wrong_frame_is_found_and_its_cure_is_named(liquid, change, named):
    recording = seen_as(bundled_recording(liquid), change)
    (fault,) = frame_faults(recording)
    assert all(name in fault for name in named)
    assert recording_warnings([recording]) == [f"{recording.path}: {fault}"]


def test_missing_samples_and_noise_do_no_harm(rng):
    recording = bundled_recording(PASSING)
    noisy = recording.inclination + np.radians(0.5) * rng.normal(size=recording.inclination.shape)
    noisy[40:50] = np.nan
    way = np.array(recording.gripper.position)
    way[70:74, 1] = np.nan
    worse = replace(recording, inclination=noisy, gripper=Trajectory(recording.time, way))
    assert list(frame_faults(worse)) == []
    found = found_turn(turned(worse, 45.0))
    assert found is not None and found.angle_deg == pytest.approx(45.0, abs=3.0)


def test_a_stick_that_was_not_seen_to_follow_is_not_judged(rng):
    recording = bundled_recording(PASSING)
    blind = replace(recording, inclination=rng.normal(size=recording.inclination.shape))
    assert found_turn(blind) is None


def test_on_a_circle_a_delay_is_not_taken_for_a_turn(rng):
    recording = bundled_recording(PASSING)
    phase = 2.0 * np.pi * recording.time
    circle = moving(recording, 0.02 * np.cos(phase), 0.02 * np.sin(phase))
    for late in (circle, turned(circle, -60.0)):
        noise = np.radians(0.5) * rng.normal(size=late.inclination.shape)
        steady = replace(late, inclination=late.inclination + noise)
        # the start, from which a turn could be told, is cut off
        assert found_turn(_without_start(steady, 40)) is None
    eight = moving(recording, 0.02 * np.sin(phase), 0.02 * np.sin(1.7 * phase))
    assert len(list(frame_faults(turned(eight, 45.0)))) == 1


def test_strokes_along_one_line_tell_a_turn_but_no_mirror():
    recording = bundled_recording(PASSING)
    line = moving(recording, 0.02 * np.sin(4.0 * recording.time), np.zeros(recording.time.size))
    assert list(frame_faults(line)) == []
    found = found_turn(turned(line, 2.0 * MAX_TURN_DEG))
    assert found is not None and not found.mirrored
    assert found.angle_deg == pytest.approx(2.0 * MAX_TURN_DEG, abs=0.5)
