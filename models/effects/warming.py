"""A liquid that gets warmer, and so thinner, while it is watched."""

from ..effect import Effect, prior_of


def _rheology():
    import taichi as ti

    @ti.func
    def warms(viscosity, shear_rate, time, coefficient):
        return viscosity * ti.exp(-coefficient * time)

    return warms


EFFECT = Effect(
    name="warming",
    unit="1/s",
    neutral=0.0,
    acts_in="liquid",
    text="The logarithm of the viscosity falls at this rate from the start of the recording or "
    "of the pour (negative: the liquid cools).",
    source="First order of any law of viscosity and temperature at a constant rate of heating; "
    "glycerol at 20 C loses 0.09 of the logarithm per kelvin (Cheng 2008)",
    # a factor of two within 7 s: hot liquid in a cold cup; glycerol at room temperature, which
    # loses 0.09 per kelvin, changes by a tenth of that
    make_prior=prior_of("Normal", 0.0, 0.1),
    make_rheology=_rheology,
)
