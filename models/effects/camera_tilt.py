"""Cameras whose frame is tipped about the y axis.

The camera that looks along y, at the xz plane, is rolled by it, and its angles shift by a
constant. If both stand on one frame, the one that looks along x is pitched, which changes its
angles only by the product of tilt and both angles (below 0.01 degrees for 1, 3 and 3 degrees); that
is left out. `camera_tilt_yz` rolls that camera.
"""

from functools import partial

import numpy as np

from ..effect import Effect, prior_of


def _signal(time, angles, coefficient, plane):
    return angles + coefficient[:, None, None] * np.eye(2)[plane]


def rolled(name, plane, text):
    """The effect of one camera rolled; `plane` is 0 for xz, 1 for yz."""
    return Effect(
        name=name,
        unit="rad",
        neutral=0.0,
        acts_in="sensor",
        text=text,
        source="A camera rolled about its optical axis turns the whole picture by the angle",
        make_prior=prior_of("Normal", 0.0, np.radians(1.0)),
        signal=partial(_signal, plane=plane),
    )


EFFECT = rolled(
    "camera_tilt",
    0,
    "The camera that looks along y is rolled: the inclination in the xz plane shows a constant "
    "offset.",
)
