"""Surface tension in newtons per metre, by the force that also makes cohesion."""

from ..effect import Effect

ROUNDING_OVER_ATTRACTION = 16.0  # with less, small drops are stiffer than their size says
# tension over density, attraction and spacing²: with it drops swing at Rayleigh's frequency, see
# tests/models/test_surface_tension.py; the square of what that test finds multiplies it
UNIT_TENSION = 1.35


def _prior():
    import numpyro.distributions as dist

    # water has 0.073 N/m, glycerol 0.063, oils 0.03
    return dist.Uniform(0.0, 0.1)


def _force():
    import taichi as ti

    @ti.func
    def contract(scene: ti.template(), b, coefficient):  # type: ignore[valid-type]
        unit = UNIT_TENSION * scene.density[b] * scene.spacing * scene.spacing
        scene.contract(b, coefficient / unit, ROUNDING_OVER_ATTRACTION * coefficient / unit)

    return contract


EFFECT = Effect(
    name="surface_tension",
    unit="N/m",
    neutral=0.0,
    acts_in="liquid",
    text="The surface of the liquid pulls itself together, so that drops become round and streams "
    "break up; it adds to what cohesion does, and walls are not wetted by it.",
    source="Attraction along the density's gradient and curvature as in Akinci 2013 (ACM Trans. "
    "Graph. 32, 182); the unit from the frequency of a drop, 8 sigma / (rho R^3) for its square "
    "(Rayleigh 1879, Proc. R. Soc. 29, 71)",
    make_prior=_prior,
    make_force=_force,
    lowest=0.0,
    highest=0.15,  # more makes particles of millimetres boil
)
