"""Effective viscosity of a flow between plates that a body force drives."""

import numpy as np
from scipy.optimize import root_scalar

from ...fluid.numerics import ParticleNumerics
from ..analysis.profiles import binned_profile, fit_poiseuille
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..scenes.channel import Profiles
from ..truths.shear_flows import poiseuille_steady
from . import _channel
from ._channel import APART, CHANNEL, DENSITY, LOOKS, PACKINGS, SPEED, VISCOSITY

THIN = 0.001  # Pa s, asked of particles that cannot flow with so little
SECONDS = 4.0  # before the first look
TOLERANCE = 0.1
FLOOR_TOLERANCE = 0.25  # of the closed form that results report


def by_flux(viscosity: float, flow: Profiles, seconds: float) -> float:
    """Effective viscosity [Pa s] from the mean velocity, which slip at the walls changes too.

    From the flow of the viscosity asked for, the mean tends to that of the effective one, all but
    exactly as the first sine does: at the rate ν π²/gap².

    Returns:
        NaN where the mean has fallen or risen beyond a hundredfold viscosity.
    """
    first, last = flow.velocity[0].mean(), flow.velocity[1:].mean()

    def missing(ratio: float) -> float:
        rate = ratio * viscosity / DENSITY * (np.pi / CHANNEL.gap) ** 2
        return first * (1.0 / ratio + (1.0 - 1.0 / ratio) * np.exp(-rate * seconds)) - last

    low, high = 0.01, 100.0
    if missing(low) * missing(high) > 0.0:
        return np.nan
    return viscosity * float(root_scalar(missing, bracket=(low, high)).root)


def steady(viscosity: float, seed: int) -> tuple[Profiles, float]:
    """The flow of one liquid, first at the start, and its driving force per volume [Pa/m]."""
    gradient = 8.0 * viscosity * SPEED / CHANNEL.gap**2

    def start(z: np.ndarray) -> np.ndarray:
        return poiseuille_steady(z, gap=CHANNEL.gap, gradient=gradient, viscosity=viscosity)

    looks = [0.0, *(SECONDS + APART * np.arange(LOOKS))]
    return _channel.flow(viscosity, (0.0, gradient / DENSITY), start, looks, seed), gradient


def run(progress: Progress, seed: int) -> CaseResult:
    """By curvature and by flux, over several packings and looks."""
    rows, curves, notes = [], [], {}
    fine = np.linspace(0.0, CHANNEL.gap, 50)
    exact = poiseuille_steady(fine, gap=CHANNEL.gap, gradient=8 / CHANNEL.gap**2, viscosity=1.0)
    curves.append(Curve("parabola", fine / CHANNEL.gap, exact, truth=True))
    for number, viscosity in enumerate((*VISCOSITY, THIN)):
        flow, gradient = steady(viscosity, seed)
        z, velocity = flow.z[1:].ravel(), flow.velocity[1:].ravel()
        mean_time = SECONDS + 0.5 * APART * (LOOKS - 1)
        flux = by_flux(viscosity, flow, mean_time)
        fit = fit_poiseuille(z, velocity, CHANNEL.gap, gradient)
        name = f"{viscosity:g} Pa s"
        notes[f"slip at {name} [m/s]"] = [round(slip, 4) for slip in fit.slip]
        if viscosity == THIN:
            floor = ParticleNumerics().least_viscosity(CHANNEL.spacing, DENSITY, SPEED)
            rows.append(
                Row.relative(f"least that {name} flows with [Pa s]", floor, flux, FLOOR_TOLERANCE)
            )
        else:
            curved = f"{name} by the profile's bend [Pa s]"
            rows += [
                Row.relative(curved, viscosity, fit.viscosity, TOLERANCE),
                Row.relative(f"{name} by the flux [Pa s]", viscosity, flux, TOLERANCE),
            ]
        profile = binned_profile(z, velocity, 0.0, CHANNEL.gap, CHANNEL.layers)
        curves.append(Curve(name, profile.at / CHANNEL.gap, profile.mean / SPEED, series=number))
        progress((number + 1) / (len(VISCOSITY) + 1))
    panel = Panel("height / gap", "velocity / middle's", tuple(curves))
    return CaseResult(tuple(rows), (panel,), notes)


CASE = Case(
    name="poiseuille",
    title="Flow between plates, driven by a force",
    truth="a parabola as high as the viscosity asked for makes it; at 1 mPa s, the least there is",
    source="Batchelor 1967, section 4.2; the least viscosity: `ParticleNumerics`",
    unit="relative",
    tolerance=TOLERANCE,
    settings={
        "viscosity": (*VISCOSITY, THIN),
        "spacing": CHANNEL.spacing,
        "layers": CHANNEL.layers,
        "speed": SPEED,
        "packings": PACKINGS,
        "seconds": SECONDS,
    },
    run=run,
)
