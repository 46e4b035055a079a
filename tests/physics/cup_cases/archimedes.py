"""Lift: sticks that are lighter than the liquid float at one angle, one as heavy stays anywhere."""

import numpy as np
from bolfi_liquids.models.liquid import Liquid
from bolfi_liquids.models.stir_setup import Cup, Stick, StirSetup
from bolfi_liquids.models.stirring import stir
from case import Case, CaseResult, Curve, Panel, Row
from cases._stirring import Path, rod
from truths.pendulum import floating_angle

DENSITY, VISCOSITY = 1000.0, 0.1  # kg/m³, Pa s: thick enough to come to rest
RADIUS, LENGTH = 0.006, 0.12  # m
CUP = Cup(radius=0.075, height=0.06, fill=0.05)
SUBMERGED = 0.04  # m, upright
SHARES = (0.4, 0.45, 0.5)  # of the liquid's density; at 0.556 a stick hangs upright, slowly
START = 10.0  # deg
SECONDS, RATE = 5.0, 50.0
SUNK_LENGTH = 0.045  # m: a stick whose pivot lies in the surface
SUNK_START = (10.0, 20.0)  # deg
TOLERANCE, DRIFT_TOLERANCE = 0.02, 0.02  # of the angle


def angles(stick: Stick, submerged: float, start: float, seed: int) -> np.ndarray:
    """Of a stick that is let go at `start` [deg] under a pivot at rest, shape [T], in degrees."""
    setup = StirSetup(CUP, stick, submerged, tilt=(np.radians(start), 0.0))
    time = np.arange(round(SECONDS * RATE) + 1) / RATE
    pivot = [0.0, 0.0, stick.length - submerged + CUP.fill]
    path = Path(time, np.tile(pivot, (len(time), 1)))
    liquid = Liquid(VISCOSITY, 0.0, DENSITY)
    return np.degrees(stir(liquid, path, setup, [seed])[0, :, 0])


def stick_of(length: float, density: float) -> Stick:
    return Stick(RADIUS, length, density * np.pi * RADIUS**2 * length)


def run(seed: int) -> CaseResult:
    """The angle at the end of each float, and how far a stick of the liquid's density drifts."""
    rows, curves = [], []
    time = np.arange(round(SECONDS * RATE) + 1) / RATE
    for share in SHARES:
        stick = stick_of(LENGTH, share * DENSITY)
        expected = float(np.degrees(floating_angle(rod(stick), LENGTH - SUBMERGED, DENSITY)))
        angle = angles(stick, SUBMERGED, START, seed)
        name = f"density {share:g} of the liquid's"
        last = float(angle[time > SECONDS - 1.0].mean())
        rows.append(Row.relative(f"angle at rest, {name} [deg]", expected, last, TOLERANCE))
        curves += [
            Curve(f"Archimedes, {name}", time, np.full_like(time, expected), True, len(rows) - 1),
            Curve(name, time, angle, series=len(rows) - 1),
        ]
    for start in SUNK_START:
        angle = angles(stick_of(SUNK_LENGTH, DENSITY), SUNK_LENGTH, start, seed)
        name = f"as dense as the liquid, from {start:g} deg"
        rows.append(Row.relative(f"angle, {name} [deg]", start, angle[-1], DRIFT_TOLERANCE))
        curves.append(Curve(name, time, angle, series=len(rows) - 1))
    return CaseResult(tuple(rows), (Panel("time [s]", "inclination [deg]", tuple(curves)),))


CASE = Case(
    truth="weight and lift cancel at one angle; at the liquid's density, at any",
    source="Archimedes, On Floating Bodies; a thin rod on a pivot",
    unit="relative",
    run=run,
)
