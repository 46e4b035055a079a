"""Faults of frames, cameras and stamps are found and named, and a stir without any passes."""

import re
from dataclasses import replace

import numpy as np
import pytest

from bolfi_liquids.inputs.bundled import RECORDED_LIQUIDS, bundled_recording
from bolfi_liquids.inputs.frame import MAX_TURN_DEG, frame_faults, recording_warnings
from bolfi_liquids.inputs.recording import Trajectory

PASSING, SHORT = "glycerin", 60


def seen_as(recording, change):
    """A recording whose inclination, as a complex number, was changed."""
    changed = change(recording.inclination @ (1.0, 1j))
    return replace(recording, inclination=np.column_stack([changed.real, changed.imag]))


def turned(recording, angle_deg):
    return seen_as(recording, lambda seen: np.exp(1j * np.radians(angle_deg)) * seen)


def at_times(recording, plane, times):
    """One plane, or both with None, as they were at other times."""
    inclination = np.array(recording.inclination)
    for k in range(2) if plane is None else [plane]:
        inclination[:, k] = np.interp(times, recording.time, inclination[:, k])
    return replace(recording, inclination=inclination)


def turned_alone(recording, plane, angle_deg):
    inclination = np.array(recording.inclination)
    inclination[:, plane] = turned(recording, angle_deg).inclination[:, plane]
    return replace(recording, inclination=inclination)


def shaken(recording, sd_deg=0.5):
    rng = np.random.default_rng(0)
    noise = np.radians(sd_deg) * rng.normal(size=recording.inclination.shape)
    return replace(recording, inclination=recording.inclination + noise)


def moving(recording, x, y):
    """The recording with another path, and a stick that trails it by 0.1 s."""
    path = np.column_stack([x, y, recording.gripper.position[:, 2]])
    late = [np.interp(recording.time - 0.1, recording.time, axis) for axis in (x, y)]
    way = Trajectory(recording.time, path)
    return replace(recording, gripper=way, inclination=-4.0 * np.column_stack(late))


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
def test_a_stir_without_faults_passes(liquid):
    recording = bundled_recording(liquid)
    gap = np.array(shaken(recording).inclination)
    gap[40:50] = np.nan
    parts = (recording.first(SHORT), recording.first(recording.time.size // 2), shaken(recording))
    for one in (recording, *parts, replace(recording, inclination=gap)):
        assert recording_warnings([one]) == []


FAULTS = {
    "45 deg": (lambda r: turned(r, 45.0), "add (45|50|55) to `yaw_deg`"),
    "yz": (lambda r: seen_as(r, np.conj), "flip.*inclination_yz"),
    "exchanged": (
        lambda r: seen_as(r, lambda seen: 1j * np.conj(seen)),
        "planes are exchanged;",
    ),
    "mirrored and 45 deg": (
        lambda r: seen_as(r, lambda seen: np.exp(0.25j * np.pi) * np.conj(seen)),
        "mirrored.*yaw_deg.*flip",
    ),
    "yz late": (
        lambda r: at_times(r, 1, r.time - 0.2),
        "inclination_yz comes 0.2 s later than inclination_xz",
    ),
    "yz turned alone": (lambda r: turned_alone(r, 1, -40.0), "inclination_yz alone is turned by -"),
    "xz turned alone": (lambda r: turned_alone(r, 0, 40.0), "inclination_xz alone is turned by "),
    "degrees twice": (
        lambda r: replace(r, inclination=r.inclination * (1.0, np.radians(1.0))),
        "inclination_xz over x is 57.3 times",
    ),
    "taken at 25 Hz": (
        lambda r: at_times(r, None, r.time[0] + (r.time - r.time[0]) * 1.2),
        r"taken at 2[45]\.?\d* Hz.* given at 30 Hz",
    ),
}


@pytest.mark.parametrize(("spoil", "named"), FAULTS.values(), ids=FAULTS)
def test_each_fault_is_found_in_a_swirling_liquid_and_named(spoil, named):
    for liquid in ("water", "oil"):  # which swirl
        recording = spoil(shaken(bundled_recording(liquid), 0.2))
        (fault,) = frame_faults(recording)
        assert re.search(named, fault), (liquid, fault)
        assert recording_warnings([recording]) == [f"{recording.path}: {fault}"]


def test_what_was_not_seen_to_follow_is_not_judged():
    recording = bundled_recording(PASSING)
    noise = np.random.default_rng(0).normal(size=recording.inclination.shape)
    assert list(frame_faults(replace(recording, inclination=noise))) == []
    assert list(frame_faults(replace(recording, inclination=0.0 * noise))) == []


def test_on_a_circle_a_delay_is_not_taken_for_a_turn():
    recording = bundled_recording(PASSING)
    phase = 2.0 * np.pi * recording.time
    circle = moving(recording, 0.02 * np.cos(phase), 0.02 * np.sin(phase))
    late = replace(circle, inclination=turned(circle, -60.0).inclination)
    kept = slice(40, None)  # the start, from which a turn could be told, is cut off
    path = Trajectory(late.time[kept], late.gripper.position[kept])
    steady = replace(late, time=path.time, gripper=path, inclination=late.inclination[kept])
    assert list(frame_faults(shaken(steady))) == []
    eight = moving(recording, 0.02 * np.sin(phase), 0.02 * np.sin(1.7 * phase))
    assert "add 45 to" in next(frame_faults(turned(eight, 45.0)))
    assert "add 45 to" in next(frame_faults(turned(recording.first(120), 45.0)))


def test_strokes_along_one_line_tell_a_turn_but_no_mirror():
    recording = bundled_recording(PASSING)
    line = moving(recording, 0.02 * np.sin(4.0 * recording.time), np.zeros(recording.time.size))
    assert list(frame_faults(line)) == []
    assert "inclination is turned by 30 deg" in next(frame_faults(turned(line, 2 * MAX_TURN_DEG)))
