"""Windows of a stir."""

from pathlib import Path

import numpy as np
from bolfi_liquids.hardware.motion import Trajectory, star

from bolfi_liquids.calibration.stirs import windows
from bolfi_liquids.inputs.recording import Recording
from bolfi_liquids.inputs.strokes import resting
from bolfi_liquids.simulators import StirSimulator


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
