"""Another mass of the stick than was written down."""

from ..effect import Effect, prior_of


def _rig(rig, coefficient):
    return rig._replace(stick_mass=rig.stick_mass * coefficient)


EFFECT = Effect(
    name="stick_mass",
    unit="1",
    neutral=1.0,
    acts_in="rig",
    text="The stick's mass is this many times what the recording says.",
    source="Weight and inertia of a uniform rod are proportional to its mass; in a liquid of "
    "viscosity mu and density rho the stick depends on mu / mass and rho / mass alone, so in "
    "air its swing does not show its mass",
    make_prior=prior_of("LogNormal", 0.0, 0.15),
    rig=_rig,
    lowest=0.01,
)
