"""A viscosity that falls with the shear rate."""

from ..effect import Effect, prior_of

ONSET_TIME = 1.0  # s, one over the shear rate at which thinning sets in


def _rheology():
    import taichi as ti

    @ti.func
    def thins(viscosity, shear_rate, time, coefficient):
        x = ONSET_TIME * shear_rate
        return viscosity * (1.0 + x * x) ** (-0.5 * coefficient)

    return thins


EFFECT = Effect(
    name="shear_thinning",
    unit="1",
    neutral=0.0,
    acts_in="liquid",
    text="The faster it is sheared, the thinner the liquid: this is 1 - n, by which the exponent "
    "n of its power law falls short of 1; the viscosity is the one at rest.",
    source="Carreau 1972 (Trans. Soc. Rheol. 16, 99) without a limit at high rates: viscosity "
    "times (1 + (rate 1 s)^2)^((n - 1) / 2)",
    # from no thinning to that of a carbomer gel
    make_prior=prior_of("Uniform", 0.0, 0.8),
    make_rheology=_rheology,
    lowest=-1.0,
    highest=0.95,
)
