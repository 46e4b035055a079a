"""A wave from side to side of a cup."""

import numpy as np

from ..analysis.motion import oscillation
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..scenes.still_cup import Flow, StillCup, flow_in_cup
from ..truths.cup_flows import sloshing_period, sloshing_velocity

RADIUS = 0.04  # m
DEPTHS = (0.03, 0.05, 0.0525)  # m; the last surface lies in the middle of cells
VISCOSITY = np.array([0.001, 0.01])  # Pa s
SPEED, SLOW = 0.12, 0.06  # m/s at the surface: waves of 6 and 3 mm, of a cell and of half
SECONDS = 2.5
TOLERANCE, MIDDLE_TOLERANCE = 0.04, 0.06  # where the surface lies on faces, and in the middle


def wave(depth: float, speed: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and the x of the liquid's centre [m], shape [steps, B]."""

    def start(points: np.ndarray) -> np.ndarray:
        return speed * sloshing_velocity(points, RADIUS, depth)

    cup = StillCup(radius=RADIUS, depth=depth)
    return flow_in_cup(cup, VISCOSITY, Flow(start), SECONDS, _centre, seed)


def run(progress: Progress, seed: int) -> CaseResult:
    """Period of the liquid's centre, which is at rest in the middle before the wave."""
    rows, curves, notes = [], [], {}
    for number, depth in enumerate(DEPTHS):
        time, centre = wave(depth, SPEED, seed)
        expected = sloshing_period(RADIUS, depth)
        allowed = MIDDLE_TOLERANCE if depth == DEPTHS[-1] else TOLERANCE
        for mu, x in zip(VISCOSITY, centre.T, strict=True):
            swing = oscillation(time, x)
            name = f"{1e3 * depth:g} mm deep, {mu:g} Pa s"
            rows.append(Row.relative(f"period {name} [s]", expected, swing.period, allowed))
            notes[f"decay {name} [1/s]"] = swing.decay
            curves.append(Curve(name, time, 1e3 * x, series=len(curves)))
        time, centre = wave(depth, SLOW, seed)
        slow = oscillation(time, centre[:, 0]).period / expected
        notes[f"period over theory, {1e3 * depth:g} mm deep, half the wave"] = slow
        progress((number + 1) / len(DEPTHS))
    panel = Panel("time [s]", "centre of the liquid [mm]", tuple(curves))
    return CaseResult(tuple(rows), (panel,), notes)


def _centre(position: np.ndarray, velocity: np.ndarray) -> float:
    return position[:, 0].mean()


CASE = Case(
    name="sloshing",
    title="Wave from side to side",
    truth="the period of the lowest wave in a cylinder, ω² = g k tanh(k h), k = 1.841/R",
    source="Lamb, Hydrodynamics, section 191",
    unit="relative",
    tolerance=TOLERANCE,
    settings={
        "depths": DEPTHS,
        "viscosity": VISCOSITY.tolist(),
        "speeds": (SPEED, SLOW),
        "seconds": SECONDS,
    },
    run=run,
)
