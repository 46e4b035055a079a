"""A gripper that moves farther or less far than was written down."""

import numpy as np

from ..effect import Effect, prior_of


def _rig(rig, coefficient):
    start = rig.path[:, :1]
    factor = np.ones((len(coefficient), 1, 3))
    factor[:, 0, :2] = coefficient[:, None]
    return rig._replace(path=start + factor * (rig.path - start))


EFFECT = Effect(
    name="gripper_scale",
    unit="1",
    neutral=1.0,
    acts_in="rig",
    text="The gripper's horizontal displacements are this many times what the recording says.",
    source="Scaling of x and y about the path's first point, as by a wrong unit or kinematic "
    "model of the robot; heights are kept",
    make_prior=prior_of("LogNormal", 0.0, 0.1),
    rig=_rig,
    lowest=0.0,
)
