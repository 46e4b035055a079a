"""What clings to the wall of a cup that was poured out, against its viscosity."""

import numpy as np

from ...cups import Cups
from ...fluid.liquid import Liquid
from ...pouring import DRIP_TIME, PourAction, pour
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..truths.films import jeffreys_volume
from ..truths.surfaces import GRAVITY

CUPS = Cups.model_validate(
    {
        "source": {"radius": 0.028, "height": 0.06, "fill": 0.034},
        "receiver": {"radius": 0.035, "height": 0.07},
        "pour": {
            "lip_height": 0.2,
            "final_angle_deg": 135.0,
            "hold": 0.9,
            "angular_velocity_deg_s": (30.0, 180.0),
            "distance": (0.0, 0.07),
        },
    }
)
ACTION = PourAction(angular_velocity=np.pi, distance=0.02)
VISCOSITY = np.array([0.001, 0.01, 0.1, 1.0, 3.0, 10.0])
COMPARED = 1.0  # Pa s; a thicker liquid has not become a film when the pour ends
DENSITY, SEEDS = 1260.0, 4
TOLERANCE = 0.03  # of the liquid: what the cup's floor and the turn add to the estimate


def film(viscosity: np.ndarray) -> np.ndarray:
    """Fraction of the liquid that Jeffreys' film holds when the pour ends.

    The liquid leaves over the lower half of the wall, which then slopes as the cup does. Its
    film drains for the whole hold; that it was thicker while the cup still turned is left out.
    """
    source = CUPS.source
    along = GRAVITY * abs(np.cos(CUPS.pour.final_angle))
    volume = jeffreys_volume(
        np.pi * source.radius,
        source.height,
        CUPS.pour.hold + DRIP_TIME,
        viscosity=viscosity,
        density=DENSITY,
        gravity=along,
    )
    return np.asarray(volume / CUPS.liquid_volume)


def run(progress: Progress, seed: int) -> CaseResult:
    """Retained fractions, the mean over packings, and whether they grow with viscosity."""
    retained = np.empty((SEEDS, len(VISCOSITY)))
    for number in range(SEEDS):
        seeds = np.full(len(VISCOSITY), seed * SEEDS + number)
        retained[number] = pour(Liquid(VISCOSITY, 0.0, DENSITY), ACTION, CUPS, seeds).retained
        progress((number + 1) / SEEDS)
    ours, expected = retained.mean(axis=0), film(VISCOSITY)
    rows = [
        Row.absolute(f"retained at {v:g} Pa s", e, o, TOLERANCE)
        for v, e, o in zip(VISCOSITY, expected, ours, strict=True)
        if v <= COMPARED
    ]
    falls = float(np.maximum(-np.diff(ours), 0.0).max())
    rows.append(Row.absolute("largest fall with viscosity", 0.0, falls, 0.002))
    fine = np.geomspace(VISCOSITY[0], COMPARED, 50)
    curves = (
        Curve("Jeffreys' film", fine, film(fine), truth=True),
        Curve("simulated", VISCOSITY, ours),
    )
    panel = Panel("viscosity [Pa s]", "retained fraction", curves, log="x")
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    name="retained_film",
    title="Liquid that clings to a cup",
    truth="a film that drains under gravity, thicker with the root of the viscosity",
    source="Jeffreys 1930, Proc. Camb. Phil. Soc. 26, 204; half the wall, at the final angle",
    unit="fraction",
    tolerance=TOLERANCE,
    settings={"viscosity": VISCOSITY.tolist(), "seeds": SEEDS, **CUPS.settings()},
    run=run,
)
