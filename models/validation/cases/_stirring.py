"""What the cases with a stick share: paths of the gripper and angles of the stick."""

from dataclasses import asdict
from typing import NamedTuple

import numpy as np

from ...fluid.numerics import PUBLISHED_DRAG, ParticleNumerics
from ...stir_setup import Stick
from ..truths.pendulum import Rod

STICKS = {"": ParticleNumerics(), ", drag as published": PUBLISHED_DRAG}
KICK = 2  # samples that a kick lasts


class Path(NamedTuple):
    """Times [T] in s and pivot positions [T, 3] in m."""

    time: np.ndarray
    position: np.ndarray


def kicked(shift: float, height: float, seconds: float, rate: float) -> Path:
    """A pivot `height` above the cup's floor that jumps by `shift` along x to the axis [m].

    The stick's middle hardly follows, so it is left at rest and tilted, by about 1.5 shift /
    length in air. Samples at `rate` [Hz]; the jump ends at sample `KICK`.
    """
    time = np.arange(round(seconds * rate) + 1) / rate
    x = shift * (np.minimum(time * rate / KICK, 1.0) - 1.0)
    return Path(time, np.column_stack([x, np.zeros_like(x), np.full_like(x, height)]))


def rod(stick: Stick) -> Rod:
    """The stick, as the truths know it."""
    return Rod(**asdict(stick))


def tilt(signal: np.ndarray) -> np.ndarray:
    """Angle from the downward vertical [rad], shape [...], of inclinations [..., 2]."""
    return np.arctan(np.hypot(*np.moveaxis(np.tan(signal), -1, 0)))
