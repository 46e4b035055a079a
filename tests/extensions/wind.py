"""An effect of one's own: a steady wind that blows on the stick in the gripper's x direction.

Register it in each process that simulates, `models.register(EFFECT)`, and check one of your own by
`pytest tests/extensions --effect your_module:EFFECT`.
"""

import numpy as np
from bolfi_liquids.models import Effect


def _prior():
    import numpyro.distributions as dist

    return dist.Normal(0.0, 0.02)


def _signal(time, angles, coefficient):
    return angles + coefficient[:, None, None] * np.array([1.0, 0.0])


EFFECT = Effect(
    name="wind",
    unit="rad",
    neutral=0.0,
    acts_in="sensor",
    text="Wind turns the stick in the xz plane by a constant angle.",
    source="A uniform drag on a light rod adds a constant torque; small angles",
    make_prior=_prior,
    signal=_signal,
)
