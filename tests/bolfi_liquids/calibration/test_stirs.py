"""Windows of a stir, the noise in it, and stirs to propose."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.hardware.motion import Trajectory, star

from bolfi_liquids.calibration.stirs import (
    camera_noise,
    held_out_noise,
    windows,
)
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.recording import Recording
from bolfi_liquids.inputs.strokes import resting
from bolfi_liquids.simulators import StirSimulator

AT_REST, RHO, SD = 16, 0.6, np.radians(0.2)


def recorded(path: Trajectory) -> Recording:
    still = np.zeros((len(path.time), 2))
    return Recording(path.time, path, still, {}, Path("stir.nc"), "hash")


def test_windows_cover_every_sample_of_every_recording_once_by_stroke():
    both = tuple(recorded(star(speed=v, height=0.2)) for v in (0.1, 0.05))
    stirring = StirSimulator(both, ())
    made = windows(stirring)
    by_stroke = [window.samples for window in made if "stroke" in window.label]
    assert (np.sum(by_stroke, axis=0) == 1).all()
    by_speed = np.sum([window.samples for window in made if "speed" in window.label], axis=0)
    moving = np.concatenate([~resting(recording) for recording in both])
    assert (by_speed == moving[:, None]).all()


@pytest.fixture(scope="module")
def stirred(calibration):
    """The run's recording."""
    return calibration.run.recordings[0]


def noisy(recording, rng, sd=SD):
    """The recording, with AR(1) noise alone as its inclination."""
    noise = sd * rng.normal(size=recording.inclination.shape)
    for i in range(1, len(noise)):
        noise[i] = RHO * noise[i - 1] + np.sqrt(1.0 - RHO**2) * noise[i]
    return replace(recording, inclination=noise)


def test_the_cameras_noise_is_that_of_the_rest_and_correlated(stirred):
    """On average over recordings: one of them knows it to a third only."""
    rng = np.random.default_rng(0)
    found = [camera_noise([noisy(stirred, rng)]) for _ in range(40)]
    assert {one.samples for one in found} == {2 * AT_REST}
    # the median of the posterior's sizes, and of their correlations, on average
    sizes = [np.median(one.sd) / SD for one in found]
    error = np.std(sizes) / np.sqrt(len(sizes))
    assert abs(np.mean(sizes) - 1.0) < 4.0 * error + 0.1
    assert np.mean([np.mean(one.correlation) for one in found]) > 0.25


def test_fitted_recordings_tell_of_the_cameras_that_saw_those_held_out(stirred, rng):
    one, other = (noisy(stirred, rng) for _ in range(2))
    assert held_out_noise(one, [other]).samples == 2 * camera_noise([one]).samples
    slower = replace(other, time=1.1 * other.time)
    assert held_out_noise(one, [slower]).samples == camera_noise([one]).samples


def test_a_camera_without_any_noise_is_not_believed(stirred, rng):
    still = noisy(stirred, rng, sd=0.0)
    # its mean is not 0.3 to the last bit
    half = replace(still, inclination=0.3 + still.inclination)
    half.inclination[:, 0] += rng.normal(size=len(still.time))
    for recordings in ([still], [half], [noisy(stirred, rng), still]):
        with pytest.raises(InputError) as refused:
            camera_noise(recordings)
        assert refused.value.where == still.path.name
