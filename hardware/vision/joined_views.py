"""Both views joined: the stick's inclination at times of the robot's clock."""

from typing import NamedTuple

import numpy as np

from .camera_model import CameraModel
from .inclination import inclination
from .measurement_series import FrameSeries, interpolate_lines


class JoinedInclination(NamedTuple):
    """The stick over time.

    Attributes:
        angle: From the downward vertical in the xz and yz planes [rad], shape (T, 2); NaN where
            a view has no good frame near enough.
        error: Standard errors [rad], shape (T, 2).
        flags: Why there is none, as `Flag`; 0 where there is one. Shape (T,).
    """

    angle: np.ndarray
    error: np.ndarray
    flags: np.ndarray


class MeasuredView(NamedTuple):
    """One camera's share: its measurements, stamped on the robot's clock, delay [s] and model."""

    series: FrameSeries
    delay: float
    camera: CameraModel


def join(xz: MeasuredView, yz: MeasuredView, times: np.ndarray) -> JoinedInclination:
    """Inclination of the stick from two cameras that do not take their frames together.

    Each view's line is interpolated to the wanted times, then both are joined.

    Args:
        xz: The camera that looks along +y.
        yz: The camera that looks along -x.
        times: Wanted times of the robot's clock [s], shape (T,).
    """
    seen_xz, seen_yz = (
        interpolate_lines(view.series, np.asarray(times) + view.delay) for view in (xz, yz)
    )
    joined = inclination(seen_xz.lines, seen_yz.lines, xz.camera, yz.camera)
    return JoinedInclination(joined.angle, joined.error, seen_xz.flags | seen_yz.flags)
