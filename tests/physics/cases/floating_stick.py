"""Buoyancy and yielding: a light stick on a pivot above a liquid floats up to one angle.

From below as from above: a liquid that bears shear at rest, as packed particles may, holds the
stick wherever it was put.
"""

import numpy as np
from bolfi_liquids.models.liquid import Liquid
from bolfi_liquids.models.stir_setup import Cup, Stick, StirSetup
from bolfi_liquids.models.stirring import stir
from case import Case, CaseResult, Curve, Panel, Row
from truths.pendulum import floating_angle

from . import _stirring

STICK = Stick(radius=0.008, length=0.15, mass=400.0 * np.pi * 0.008**2 * 0.15)
CUP = Cup(radius=0.1, height=0.15, fill=0.08)
SUBMERGED = 0.045  # m, upright
VISCOSITY, DENSITY = 0.1, 1000.0  # so thick that it comes to rest, so thin that it gets there
STARTS = {"below": 10.0, "above": 34.0}  # deg
SECONDS, RATE = 6.0, 60.0
SEEDS = 2
TOLERANCE = 0.1  # deg


def run(seed: int) -> CaseResult:
    """Mean angle over the last second, the mean over packings, from either side."""
    surface = STICK.length - SUBMERGED
    liquid = Liquid(VISCOSITY, 0.0, DENSITY)
    expected = np.degrees(floating_angle(_stirring.rod(STICK), surface, DENSITY))
    rows = []
    curves = [Curve("Archimedes", [0.0, SECONDS], [expected, expected], truth=True)]
    path = _stirring.resting(surface + CUP.fill, SECONDS, RATE)
    for number, (side, start) in enumerate(STARTS.items()):
        setup = StirSetup(CUP, STICK, SUBMERGED, tilt=(np.radians(start), 0.0))
        signals = stir(liquid, path, setup, seed * SEEDS + np.arange(SEEDS))
        angle = np.degrees(_stirring.tilt(signals))
        ours = float(angle[:, path.time > SECONDS - 1.0].mean())
        name = f"from {side}"
        rows.append(Row.absolute(f"angle at rest, {name} [deg]", expected, ours, TOLERANCE))
        curves += [
            Curve("" if k else name, path.time, trial, series=number)
            for k, trial in enumerate(angle)
        ]
    panel = Panel("time [s]", "angle from the vertical [deg]", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    truth="the torques of weight and lift cancel at one angle",
    source="Archimedes, On Floating Bodies; a thin rod on a pivot",
    unit="deg",
    run=run,
)
