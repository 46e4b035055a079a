"""Buoyancy and yielding: a light stick on a pivot above a liquid floats up to one angle.

From below as from above: a liquid that bears shear at rest, as packed particles may, holds the
stick wherever it was put.
"""

import numpy as np

from ...fluid.liquid import Liquid
from ...stir_setup import Cup, Stick, StirSetup
from ...stirring import stir
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..truths.pendulum import floating_angle
from . import _stirring

STICK = Stick(radius=0.008, length=0.15, mass=400.0 * np.pi * 0.008**2 * 0.15)
CUP = Cup(radius=0.1, height=0.15, fill=0.08)
SUBMERGED = 0.045  # m, upright
VISCOSITY, DENSITY = 0.1, 1000.0  # so thick that it comes to rest, so thin that it gets there
SHIFTS = {"below": 0.02, "above": 0.08}  # m, of the gripper at the start
SECONDS, RATE = 6.0, 60.0
PARTICLES, SEEDS = 3000, 2
TOLERANCE = 2.0  # deg


def run(progress: Progress, seed: int) -> CaseResult:
    """Mean angle over the last second, the mean over packings, from either side."""
    surface = STICK.length - SUBMERGED
    liquid = Liquid(VISCOSITY, 0.0, DENSITY)
    expected = np.degrees(floating_angle(_stirring.rod(STICK), surface, DENSITY))
    rows = []
    curves = [Curve("Archimedes", [0.0, SECONDS], [expected, expected], truth=True)]
    starts = [(side, stick) for stick in _stirring.STICKS for side in SHIFTS]
    for number, (side, stick) in enumerate(starts):
        setup = StirSetup(CUP, STICK, SUBMERGED, PARTICLES, _stirring.STICKS[stick])
        path = _stirring.kicked(SHIFTS[side], surface + CUP.fill, SECONDS, RATE)
        signals = stir(liquid, path, setup, seed * SEEDS + np.arange(SEEDS))
        angle = np.degrees(_stirring.tilt(signals))
        ours = float(angle[:, path.time > SECONDS - 1.0].mean())
        name = f"from {side}{stick}"
        rows.append(Row.absolute(f"angle at rest, {name} [deg]", expected, ours, TOLERANCE))
        curves += [
            Curve("" if k else name, path.time, trial, series=number)
            for k, trial in enumerate(angle)
        ]
        progress((number + 1) / len(starts))
    panel = Panel("time [s]", "angle from the vertical [deg]", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    name="floating_stick",
    title="Light stick that floats up, or down",
    truth="the torques of weight and lift cancel at one angle",
    source="Archimedes, On Floating Bodies; a thin rod on a pivot",
    unit="deg",
    tolerance=TOLERANCE,
    settings={
        "viscosity": VISCOSITY,
        "particles": PARTICLES,
        "seeds": SEEDS,
        "seconds": SECONDS,
        "shifts": SHIFTS,
    },
    run=run,
)
