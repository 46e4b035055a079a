"""A recording must start as a simulation does."""

import re
from dataclasses import replace

import numpy as np
import pytest

import bolfi_liquids as bl
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.open import read_recording
from bolfi_liquids.inputs.recording import Trajectory
from bolfi_liquids.inputs.start import check_start, first_rest

RATE = 30.0  # of the bundled recordings [Hz]
SEEDS = range(3)


@pytest.fixture(params=("water", "gel"))  # the thinnest and the thickest
def stir(request):
    return bundled_recording(request.param)


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
    hanging = np.radians(0.1) * np.random.default_rng(0).normal(size=(count, 2))
    return replace(
        recording,
        time=(together := np.concatenate([time, later])),
        gripper=Trajectory(together, np.concatenate([way, recording.gripper.position])),
        inclination=np.concatenate([hanging, recording.inclination]),
    )


def test_a_recording_from_rest_is_taken_whatever_its_noise(stir):
    for sd in ((0.0, 0.0), (1e-4, np.radians(0.3)), (5e-4, np.radians(1.0))):
        for seed in SEEDS:
            noisy = shaken(stir, sd, seed)
            check_start(noisy)
            assert first_rest(noisy) == pytest.approx(noisy.time[0], abs=0.2)


def test_a_recording_from_the_middle_of_a_stir_is_refused(stir):
    """A few cuts hit a corner at which the stick happens to hang: nothing can be seen there."""
    cuts = range(24, len(stir.time) - 60, 4)
    passed = []
    for start in cuts:
        try:
            check_start(part(stir, start))
        except bl.InputError as err:
            assert "starts in motion" in err.what and "trim" not in err.fix
        else:
            passed.append(start)
    assert len(passed) <= 0.05 * len(cuts), passed


def test_the_frame_rate_does_not_matter(stir):
    for rate in (10.0, 125.0):
        time = np.arange(stir.time[0], stir.time[-1], 1.0 / rate)
        position, inclination = (
            np.stack([np.interp(time, stir.time, one) for one in values.T], axis=-1)
            for values in (stir.gripper.position, stir.inclination)
        )
        gripper = Trajectory(time, position)
        other = replace(stir, time=time, gripper=gripper, inclination=inclination)
        check_start(other)
        with pytest.raises(bl.InputError, match="starts in motion"):
            check_start(part(other, int(1.3 * rate)))


def test_the_way_down_is_seen_and_the_rest_after_it_offered(stir):
    recording = lowered(stir)
    with pytest.raises(bl.InputError, match="in the air, 5.0 cm above the liquid") as refused:
        check_start(recording)
    offered = float(re.search(r"--start (\S+)", refused.value.fix)[1])
    assert 2.0 - 1.5 / RATE <= offered <= 2.3
    assert first_rest(recording) == offered
    check_start(part(recording, int(np.searchsorted(recording.time, offered))))


def test_an_arm_that_has_just_come_down_is_no_motion(stir):
    """Recorders begin with the plan's rest, which an arm enters a tenth of a second late."""
    late = lowered(stir, from_=-0.005)
    at = int(2.0 * RATE)
    check_start(part(late, at - 3))
    for start in (0, at - 15):
        with pytest.raises(bl.InputError, match="the gripper moves at"):
            check_start(part(late, start))


def test_a_stick_that_swings_while_the_gripper_rests_is_seen_and_a_tilt_is_not():
    recording = bundled_recording("water")
    rest = recording.time < recording.time[0] + 0.4
    swing = np.zeros_like(recording.inclination)
    swing[rest, 0] = np.radians(6.0) * np.sin(7.0 * recording.time[rest])
    with pytest.raises(bl.InputError, match="swings|leans"):
        check_start(replace(recording, inclination=recording.inclination + swing))
    tilt = np.radians([-2.5, 0.0])
    check_start(replace(recording, inclination=recording.inclination + tilt))


def test_what_starts_in_motion_is_read_but_neither_opened_nor_calibrated(dataset, tmp_path):
    path = tmp_path / "cut.nc"
    dataset.isel(time=slice(40, None)).to_netcdf(path)
    read = read_recording(path)
    assert len(read.time) == dataset.sizes["time"] - 40
    for use in (bl.open_recording, lambda given: bl.calibrate(read, out=tmp_path / "run")):
        with pytest.raises(bl.InputError, match=f"{path}: .*starts in motion"):
            use(path)
    assert not (tmp_path / "run").exists()
