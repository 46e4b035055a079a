"""What the cases with a stick share: paths of the gripper and angles of the stick."""

from dataclasses import asdict
from typing import NamedTuple

import numpy as np
from bolfi_liquids.models.stir_setup import Stick
from truths.pendulum import Rod


class Path(NamedTuple):
    """Times [T] in s and pivot positions [T, 3] in m."""

    time: np.ndarray
    position: np.ndarray


def resting(height: float, seconds: float, rate: float) -> Path:
    """A pivot at rest on the axis, `height` above the floor [m]; samples at `rate` [Hz]."""
    time = np.arange(round(seconds * rate) + 1) / rate
    return Path(time, np.tile([0.0, 0.0, height], (len(time), 1)))


def rod(stick: Stick) -> Rod:
    """The stick, as the truths know it."""
    return Rod(**asdict(stick))


def tilt(signal: np.ndarray) -> np.ndarray:
    """Angle from the downward vertical [rad], shape [...], of inclinations [..., 2]."""
    return np.arctan(np.hypot(*np.moveaxis(np.tan(signal), -1, 0)))
