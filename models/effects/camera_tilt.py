"""Cameras whose frame is tipped about the y axis.

The camera that looks along y, at the xz plane, is rolled by it, and its angles shift by a
constant. If both stand on one frame, the one that looks along x is pitched, which changes its
angles only by the product of tilt and both angles (below 0.01 degrees for 1, 3 and 3 degrees); that
is left out. `camera_tilt_yz` rolls that camera.
"""

import numpy as np

from ..effect import Effect


def _prior():
    import numpyro.distributions as dist

    return dist.Normal(0.0, np.radians(1.0))


def _signal(time, angles, coefficient):
    offset = np.stack([coefficient, np.zeros_like(coefficient)], axis=-1)
    return angles + offset[:, None]


EFFECT = Effect(
    name="camera_tilt",
    unit="rad",
    neutral=0.0,
    acts_in="sensor",
    text="The camera that looks along y is rolled: the inclination in the xz plane shows a "
    "constant offset.",
    source="A camera rolled about its optical axis turns the whole picture by the angle",
    make_prior=_prior,
    signal=_signal,
)
