"""A recording must start as a simulation does."""

import re
from dataclasses import replace
from importlib.resources import as_file, files

import numpy as np
import pytest

import bolfi_liquids as bl
from bolfi_liquids.inputs.bundled import RECORDED_LIQUIDS, bundled_recording
from bolfi_liquids.inputs.open import read_recording
from bolfi_liquids.inputs.recording import Trajectory
from bolfi_liquids.inputs.start import check_start, first_rest

RATE = 30.0  # of the bundled recordings [Hz]
SEEDS = range(5)


def part(recording, start):
    """As if it had been recorded from this sample on."""
    time = recording.time[start:]
    gripper = Trajectory(time, recording.gripper.position[start:])
    return replace(recording, time=time, gripper=gripper, inclination=recording.inclination[start:])


def shaken(recording, sd, seed):
    """With noise of the gripper's position [m] and of the inclination [rad]."""
    rng = np.random.default_rng(seed)
    position = recording.gripper.position + sd[0] * rng.normal(size=(len(recording.time), 3))
    inclination = recording.inclination + sd[1] * rng.normal(size=recording.inclination.shape)
    return replace(recording, gripper=Trajectory(recording.time, position), inclination=inclination)


def lowered(recording, duration=2.0, from_=0.05):
    """With the stick's way down before it, from above the liquid."""
    count = int(duration * RATE)
    depth = recording.number("fill") - (
        recording.gripper.position[0, 2] - recording.number("stick_length")
    )
    above = np.linspace(depth + from_, 0.0, count, endpoint=False)
    way = recording.gripper.position[0] + np.outer(above, [0.0, 0.0, 1.0])
    time = recording.time[0] + np.arange(count) / RATE
    later = recording.time + count / RATE
    rng = np.random.default_rng(0)
    hanging = np.radians(0.1) * rng.normal(size=(count, 2))
    return replace(
        recording,
        time=(together := np.concatenate([time, later])),
        gripper=Trajectory(together, np.concatenate([way, recording.gripper.position])),
        inclination=np.concatenate([hanging, recording.inclination]),
    )


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
@pytest.mark.parametrize("sd", [(0.0, 0.0), (1e-4, np.radians(0.3)), (5e-4, np.radians(1.0))])
def test_a_recording_from_rest_is_taken(liquid, sd):
    for seed in SEEDS:
        noisy = shaken(bundled_recording(liquid), sd, seed)
        check_start(noisy)
        assert first_rest(noisy) == pytest.approx(noisy.time[0], abs=0.2)


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
def test_a_recording_from_the_middle_of_a_stir_is_refused(liquid):
    """A few cuts hit a corner at which the stick happens to hang: nothing can be seen there."""
    recording = bundled_recording(liquid)
    cuts = range(24, len(recording.time) - 60, 4)
    passed = []
    for start in cuts:
        try:
            check_start(part(recording, start))
        except bl.InputError as err:
            assert "starts in motion" in err.what and "trim" not in err.fix
        else:
            passed.append(start)
    assert len(passed) <= 0.05 * len(cuts), passed


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
def test_the_way_down_is_seen_and_the_rest_after_it_offered(liquid):
    recording = lowered(bundled_recording(liquid))
    with pytest.raises(bl.InputError, match="in the air, 5.0 cm above the liquid") as refused:
        check_start(recording)
    offered = float(re.search(r"--start (\S+)", refused.value.fix)[1])
    assert 2.0 - 1.5 / RATE <= offered <= 2.3
    assert first_rest(recording) == offered
    check_start(part(recording, int(np.searchsorted(recording.time, offered))))


def test_a_way_down_within_the_liquid_is_motion():
    recording = lowered(bundled_recording("oil"), from_=-0.005)
    with pytest.raises(bl.InputError, match="the gripper moves at"):
        check_start(recording)


def test_a_stick_that_swings_while_the_gripper_rests_is_seen():
    recording = bundled_recording("water")
    rest = recording.time < recording.time[0] + 0.4
    swing = np.zeros_like(recording.inclination)
    swing[rest, 0] = np.radians(6.0) * np.sin(7.0 * recording.time[rest])
    with pytest.raises(bl.InputError, match="swings|leans"):
        check_start(replace(recording, inclination=recording.inclination + swing))


def test_tilted_cameras_are_no_motion():
    recording = bundled_recording("glycerin")
    for tilt in (-2.5, 2.5):
        check_start(replace(recording, inclination=recording.inclination + np.radians([tilt, 0.0])))


def test_opening_refuses_it_and_reading_does_not(dataset, tmp_path):
    path = tmp_path / "cut.nc"
    dataset.isel(time=slice(40, None)).to_netcdf(path)
    with pytest.raises(bl.InputError, match=f"{path}: .*starts in motion"):
        bl.open_recording(path)
    assert len(read_recording(path).time) == dataset.sizes["time"] - 40


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
def test_bundled_recordings_open(liquid):
    with as_file(files("bolfi_liquids.data") / f"{liquid}_v10.nc") as path:
        bl.open_recording(path)


@pytest.mark.parametrize("rate", [10.0, 60.0, 125.0])
@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
def test_the_frame_rate_does_not_matter(liquid, rate):
    recording = bundled_recording(liquid)
    time = np.arange(recording.time[0], recording.time[-1], 1.0 / rate)

    def at(values):
        return np.stack([np.interp(time, recording.time, one) for one in values.T], axis=-1)

    gripper = Trajectory(time, at(recording.gripper.position))
    other = replace(recording, time=time, gripper=gripper, inclination=at(recording.inclination))
    check_start(other)
    with pytest.raises(bl.InputError, match="starts in motion"):
        check_start(part(other, int(1.3 * rate)))


def test_a_recording_that_was_cut_in_python_is_refused_before_anything_is_written(tmp_path):
    late = part(bundled_recording("oil"), 40)
    with pytest.raises(bl.InputError, match="starts in motion"):
        bl.calibrate(late, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
def test_an_arm_that_has_just_come_down_is_no_motion(liquid):
    """Recorders begin with the plan's rest, which an arm enters a tenth of a second late."""
    late = lowered(bundled_recording(liquid), from_=-0.005)
    at = int(2.0 * RATE)
    check_start(part(late, at - 3))
    with pytest.raises(bl.InputError, match="the gripper moves at"):
        check_start(part(late, at - 15))
