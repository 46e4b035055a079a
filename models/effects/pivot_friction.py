"""Dry friction in the pivot from which the stick hangs.

It holds a stick off the vertical before the gripper moves: `start_tilt` of the setup.
"""

from ..effect import Effect, prior_of


def _rig(rig, coefficient):
    return rig._replace(pivot_friction=rig.pivot_friction + coefficient)


EFFECT = Effect(
    name="pivot_friction",
    unit="N m",
    neutral=0.0,
    acts_in="rig",
    text="The pivot rubs: a constant torque opposes the stick's motion, and holds it below that.",
    source="Coulomb friction of a ball joint, as an impulse of at most torque times step (Moreau "
    "1988, Unilateral contact and dry friction); small swings in air lose the amplitude "
    "4 torque / (mass g length / 2) each cycle",
    # 5e-4 N m holds the stick of the bundled recordings 1.6 degrees off the vertical
    make_prior=prior_of("HalfNormal", 5e-4),
    rig=_rig,
    lowest=0.0,
)
