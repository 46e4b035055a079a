"""Buoyancy: a light stick on a pivot above a liquid floats up to an angle."""

import numpy as np

from ...liquid import Liquid
from ...stirring import Cup, Stick, StirSetup, stir
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..truths.pendulum import floating_angle
from . import _stirring

STICK = Stick(radius=0.008, length=0.15, mass=400.0 * np.pi * 0.008**2 * 0.15)
CUP = Cup(radius=0.1, height=0.15, fill=0.08)
SUBMERGED = 0.045  # m, upright
VISCOSITY, DENSITY = 0.1, 1000.0  # so thick that it comes to rest, so thin that it gets there
SHIFT = 0.02  # m, as upright it is in balance too
SECONDS, RATE = 6.0, 60.0
PARTICLES, SEEDS = 3000, 4
TOLERANCE = 2.0  # deg


def run(progress: Progress, seed: int) -> CaseResult:
    """Mean angle over the last second, the mean over packings."""
    setup = StirSetup(CUP, STICK, SUBMERGED, PARTICLES)
    surface = STICK.length - SUBMERGED
    path = _stirring.kicked(SHIFT, surface + CUP.fill, SECONDS, RATE)
    liquid = Liquid(VISCOSITY, 0.0, DENSITY)
    signals = stir(liquid, path, setup, seed * SEEDS + np.arange(SEEDS))
    progress(1.0)
    angle = np.degrees(_stirring.tilt(signals))
    expected = np.degrees(floating_angle(_stirring.rod(STICK), surface, DENSITY))
    ours = float(angle[:, path.time > SECONDS - 1.0].mean())
    ends = np.array([0.0, SECONDS])
    curves = [Curve("Archimedes", ends, np.full(2, expected), truth=True)]
    curves += [
        Curve("simulated" if number == 0 else "", path.time, trial)
        for number, trial in enumerate(angle)
    ]
    return CaseResult(
        (Row.absolute("angle at rest [deg]", expected, ours, TOLERANCE),),
        (Panel("time [s]", "angle from the vertical [deg]", tuple(curves)),),
    )


CASE = Case(
    name="floating_stick",
    title="Light stick that floats up",
    truth="the torques of weight and lift cancel",
    source="Archimedes, On Floating Bodies; a thin rod on a pivot",
    unit="deg",
    tolerance=TOLERANCE,
    settings={
        "viscosity": VISCOSITY,
        "particles": PARTICLES,
        "seeds": SEEDS,
        "seconds": SECONDS,
        "shift": SHIFT,
    },
    run=run,
)
