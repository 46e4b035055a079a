"""Effective viscosity of liquid that bears its own weight: particles under pressure may rub."""

import numpy as np
from scipy.optimize import root_scalar

from ...fluid.liquid import Liquid
from ..analysis.profiles import binned_profile
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..scenes.film import Film, film_flow

FILM = Film()
LIGHT = Film(gravity=1.0)  # the same where it weighs less, which tells rubbing from viscosity
VISCOSITY = np.array([0.03, 0.1, 0.3, 1.0, 5.0])
DENSITY = 1000.0
SPEED = 0.1  # m/s
SECONDS = 2.0
TOLERANCE = 0.1


def effective(viscosity: float, means: tuple[float, float], seconds: float) -> float:
    """Viscosity [Pa s] whose film slows from the first mean velocity to the second.

    As the half parabola does, all but exactly like the first sine, at ν π² / (2 depth)².
    """
    rate = viscosity / DENSITY * (0.5 * np.pi / FILM.depth) ** 2

    def missing(ratio: float) -> float:
        kept = 1.0 / ratio + (1.0 - 1.0 / ratio) * np.exp(-rate * ratio * seconds)
        return means[0] * kept - means[1]

    low, high = 0.01, 1000.0
    if missing(low) * missing(high) > 0.0:
        return np.nan
    return viscosity * float(root_scalar(missing, bracket=(low, high)).root)


def run(progress: Progress, seed: int) -> CaseResult:
    """Under its weight, and, in the notes, under a tenth of it."""
    liquid = Liquid(VISCOSITY, 0.0, DENSITY)
    fine = np.linspace(0.0, FILM.depth, 40)
    rows, notes = [], {}
    curves = [Curve("half parabola", fine / FILM.depth, FILM.profile(fine, 1.0), truth=True)]
    for number, film in enumerate((FILM, LIGHT)):
        flow = film_flow(film, liquid, SPEED, SECONDS, seed)
        for k, viscosity in enumerate(VISCOSITY):
            ours = effective(viscosity, (flow.first[k], flow.last[k]), flow.seconds)
            name = f"{viscosity:g} Pa s"
            if film is LIGHT:
                notes[f"{name}, at {LIGHT.gravity:g} m/s² [Pa s]"] = round(float(ours), 4)
                continue
            rows.append(Row.relative(f"{name} by the flux [Pa s]", viscosity, ours, TOLERANCE))
            seen = binned_profile(flow.z[k], flow.velocity[k], 0.0, FILM.depth, FILM.layers)
            curves.append(Curve(name, seen.at / FILM.depth, seen.mean / SPEED, series=k))
        progress((number + 1) / 2)
    panel = Panel("height / depth", "velocity / surface's", tuple(curves))
    return CaseResult(tuple(rows), (panel,), notes)


CASE = Case(
    name="film_flow",
    title="Layer that flows under its own weight",
    truth="a half parabola as high as the viscosity asked for makes it, whatever the pressure",
    source="Nusselt 1916; Batchelor 1967, section 4.2",
    unit="relative",
    tolerance=TOLERANCE,
    settings={
        "viscosity": VISCOSITY.tolist(),
        "layers": FILM.layers,
        "speed": SPEED,
        "seconds": SECONDS,
    },
    run=run,
)
