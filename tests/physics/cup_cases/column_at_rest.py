"""Liquid that nobody stirs stays where it is."""

import numpy as np
from analysis.motion import rms_speed
from case import Case, CaseResult, Curve, Panel, Row
from scenes.still_cup import Flow, StillCup, flow_in_cup

DEPTHS = (0.05, 0.1)  # m
VISCOSITY = np.array([0.001, 0.01, 0.1, 1.0])  # Pa s
SECONDS, SETTLED = 10.0, 2.0  # s
LEVEL_TOLERANCE = 0.01  # of the depth
TOLERANCE, FIRST_TOLERANCE = 0.001, 0.006  # m/s, RMS over particles: later, and at first


def run(seed: int) -> CaseResult:
    """How fast the liquid is while its particles find their places and after, and its level."""
    rows, curves = [], []
    for number, depth in enumerate(DEPTHS):

        def look(position: np.ndarray, velocity: np.ndarray, depth: float = depth) -> np.ndarray:
            return np.array([rms_speed(velocity), 2.0 * position[:, 2].mean() / depth])

        time, seen = flow_in_cup(StillCup(depth=depth), VISCOSITY, Flow(), SECONDS, look, seed)
        for k, mu in enumerate(VISCOSITY):
            name = f"{1e3 * depth:g} mm deep, {mu:g} Pa s"
            speed, level = seen[:, k].T
            settled = np.sqrt(np.mean(speed[time > SETTLED] ** 2))
            first = speed[time <= SETTLED].max()
            off = float(np.abs(level - 1.0).max())
            rows += [
                Row.absolute(f"rms speed {name} [m/s]", 0.0, settled, TOLERANCE),
                Row.absolute(
                    f"largest rms speed, first {SETTLED:g} s, {name} [m/s]",
                    0.0,
                    first,
                    FIRST_TOLERANCE,
                ),
                Row.absolute(
                    f"largest error of the level {name} [of the depth]", 0.0, off, LEVEL_TOLERANCE
                ),
            ]
            label = name if k in (0, len(VISCOSITY) - 1) else ""
            curves.append(Curve(label, time, 1e3 * speed, series=number))
    panel = Panel("time [s]", "rms speed [mm/s]", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    truth="it stays at rest, at its level",
    source="hydrostatics",
    unit="",
    run=run,
)
