"""Another depth of liquid than was written down."""

from ..effect import Effect, prior_of


def _rig(rig, coefficient):
    return rig._replace(fill=rig.fill + coefficient)


EFFECT = Effect(
    name="fill_level",
    unit="m",
    neutral=0.0,
    acts_in="rig",
    text="The liquid is deeper than the recording says (negative: shallower).",
    source="Volume of a cylinder less the submerged stick, in particles of unchanged size, so "
    "that one particle is the resolution",
    make_prior=prior_of("Normal", 0.0, 3e-3),
    rig=_rig,
)
