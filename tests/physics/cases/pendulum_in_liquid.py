"""Added mass, buoyancy and friction: a steel stick that swings with its end in a liquid."""

import numpy as np
from analysis.motion import far_side
from bolfi_liquids.models.liquid import Liquid
from bolfi_liquids.models.stir_setup import Cup, Stick, StirSetup
from bolfi_liquids.models.stirring import stir
from case import Case, CaseResult, Curve, Panel, Row
from truths.oscillating_rod import swing_in_liquid

from . import _stirring

STICK = Stick(radius=0.005, length=0.15, mass=8000.0 * np.pi * 0.005**2 * 0.15)
CUP = Cup(radius=0.05, height=0.12, fill=0.08)
SUBMERGED = 0.06  # m
VISCOSITY = (0.01, 0.1)
DENSITY = 1000.0
START = 1.6  # deg, so that the tip moves less than its diameter
SECONDS, RATE = 2.0, 240.0
SEEDS = 4
TOLERANCE = 0.08
LEFT_TOLERANCE = 0.08


def run(seed: int) -> CaseResult:
    """Half a period, and what is left of the swing after it; the mean over packings."""
    height = STICK.length - SUBMERGED + CUP.fill
    path = _stirring.resting(height, SECONDS, RATE)
    time, rows, curves = path.time, [], []
    setup = StirSetup(CUP, STICK, SUBMERGED, tilt=(np.radians(START), 0.0))
    for number, viscosity in enumerate(VISCOSITY):
        liquid = Liquid(viscosity, 0.0, DENSITY)
        signals = stir(liquid, path, setup, seed * SEEDS + np.arange(SEEDS))[..., 0]
        angle = signals.mean(axis=0)
        expected = swing_in_liquid(
            _stirring.rod(STICK),
            SUBMERGED,
            density=DENSITY,
            viscosity=viscosity,
            outer_radius=CUP.radius,
        )
        half, far = expected.period / 2, far_side(time, angle)
        left = float(np.exp(-expected.decay * half))
        name = f"at {viscosity:g} Pa s"
        rows += [
            Row.relative(f"half a period {name} [s]", half, far.time, TOLERANCE),
            Row.relative(f"swing left after it {name}", left, far.ratio, LEFT_TOLERANCE),
        ]
        turn = 2.0 * np.pi / expected.period * (time - time[0])
        free_swing = np.exp(-expected.decay * (time - time[0])) * np.cos(turn)
        curves += [
            Curve("", time, np.degrees(angle[0] * free_swing), truth=True, series=number),
            Curve(f"{viscosity:g} Pa s", time, np.degrees(angle), series=number),
        ]
    return CaseResult(tuple(rows), (Panel("time [s]", "inclination [deg]", tuple(curves)),))


CASE = Case(
    truth="a small swing with Archimedes' lift and Stokes' added mass and friction",
    source="Stokes 1851, Trans. Camb. Phil. Soc. 9, 8; walls in potential flow",
    unit="relative",
    run=run,
)
