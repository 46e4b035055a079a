"""Cameras whose clock is late."""

import numpy as np

from ..effect import Effect, prior_of


def _signal(time, angles, coefficient):
    # SciPy's interpolation is slow to import, and a straight line between samples 1/30 s apart
    # would clip the turning points of a stick that swings at 1.3 Hz by some hundredths of a degree
    from scipy.interpolate import CubicSpline

    # before the first sample the stick hangs at rest; after the last nothing better is known
    moments = np.clip(time - coefficient[:, None], time[0], time[-1])
    pairs = zip(angles, moments, strict=True)
    return np.stack([CubicSpline(time, trial)(moment) for trial, moment in pairs])


EFFECT = Effect(
    name="camera_delay",
    unit="s",
    neutral=0.0,
    acts_in="sensor",
    text="The cameras show the stick as it was this long before (negative: the gripper's "
    "positions are the late ones).",
    source="Offset of two clocks: seen(t) = true(t - delay), by a cubic spline, held constant "
    "outside the recorded time",
    # either clock may be the late one
    make_prior=prior_of("Normal", 0.0, 0.1),
    signal=_signal,
)
