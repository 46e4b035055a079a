"""A stress below which the liquid does not flow."""

from ..effect import Effect, prior_of

REGULARISATION_TIME = 4.0  # s: below a shear rate of 1 / (4 s) the liquid creeps


def _rheology():
    import taichi as ti

    @ti.func
    def yields(viscosity, shear_rate, time, coefficient):
        # 1 - exp(-x) loses its digits in float32 where the rate vanishes
        x = REGULARISATION_TIME * shear_rate
        share = 1.0 - 0.5 * x
        if x > 1e-3:
            share = (1.0 - ti.exp(-x)) / x
        return viscosity + coefficient * REGULARISATION_TIME * share

    return yields


EFFECT = Effect(
    name="yield_stress",
    unit="Pa",
    neutral=0.0,
    acts_in="liquid",
    text="The liquid is a gel: it flows only where it is sheared by more than this stress.",
    source="Herschel & Bulkley 1926, regularised by Papanastasiou 1987 (J. Rheol. 31, 385): "
    "viscosity + yield stress (1 - exp(-m rate)) / rate with m = 4 s",
    # hand gels have about 10 Pa, hair gels 30 to 100
    make_prior=prior_of("HalfNormal", 15.0),
    make_rheology=_rheology,
    lowest=0.0,
)
