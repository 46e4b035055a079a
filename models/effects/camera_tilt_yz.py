"""Cameras whose frame is tipped about the x axis: `camera_tilt` for the other camera.

Each camera is rolled on a tripod of its own, so the two effects are two coefficients. This one
rolls the camera that looks along x, at the yz plane, and leaves out how the other one is pitched.
"""

import numpy as np

from ..effect import Effect


def _prior():
    import numpyro.distributions as dist

    return dist.Normal(0.0, np.radians(1.0))


def _signal(time, angles, coefficient):
    offset = np.stack([np.zeros_like(coefficient), coefficient], axis=-1)
    return angles + offset[:, None]


EFFECT = Effect(
    name="camera_tilt_yz",
    unit="rad",
    neutral=0.0,
    acts_in="sensor",
    text="The camera that looks along x is rolled: the inclination in the yz plane shows a "
    "constant offset.",
    source="A camera rolled about its optical axis turns the whole picture by the angle",
    make_prior=_prior,
    signal=_signal,
)
