"""A round piece of water that was pressed flat and swings under its tension alone."""

import numpy as np
from analysis.motion import passages
from case import Case, CaseResult, Curve, Panel, Row
from scenes.wet_box import NO_PULL, Body, WetBox, WetLiquid, flow_in_box
from truths.surfaces import column_frequency

SIDE = 0.08  # m
BOXES = {5: WetBox((SIDE, 0.0, SIDE)), 10: WetBox((SIDE, 0.0, SIDE), 0.002, 0.0015)}
"""By the drop's radius in cells."""
RADIUS, STRETCH = 0.02, 1.15  # m, and of the axes to the radius
VISCOSITY = np.array([0.001, 0.01, 0.03])  # Pa s
DENSITY, TENSION = 1000.0, 0.072
PERIODS = 1.2
TOLERANCE = 0.2


def run(seed: int) -> CaseResult:
    """Twice the time from the first passage of the round shape to the second."""
    period = 1.0 / column_frequency(RADIUS, tension=TENSION, density=DENSITY)
    rows, curves = [], []
    for number, (cells, box) in enumerate(BOXES.items()):
        points = box.fill(((0.0, 0.0, 0.0), (SIDE, 0.0, SIDE)), seed)
        off = points[:, [0, 2]] - 0.5 * SIDE
        points = points[np.hypot(off[:, 0] / STRETCH, off[:, 1] * STRETCH) < RADIUS]
        liquids = [WetLiquid(mu, DENSITY, TENSION, pull=NO_PULL) for mu in VISCOSITY]
        bodies = [Body(points, np.pi * RADIUS**2 * box.cell)] * len(liquids)
        time, seen = flow_in_box(box, liquids, bodies, PERIODS * period, _stretch)
        for k, mu in enumerate(VISCOSITY):
            at = passages(time, seen[:, k])
            ours = 2.0 * (at[1] - at[0]) if len(at) > 1 else np.nan
            name = f"period, {cells} cells in radius, {mu:g} Pa s [s]"
            rows.append(Row.relative(name, period, ours, TOLERANCE))
            curves.append(Curve(f"{cells} cells, {mu:g} Pa s", time, seen[:, k], series=number))
    fine = np.linspace(0.0, PERIODS * period, 100)
    swing = (STRETCH**2 - 1.0) * np.cos(2.0 * np.pi * fine / period)
    curves.append(Curve("without friction", fine, swing, truth=True))
    panel = Panel("time [s]", "width over height, less 1", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


def _stretch(position: np.ndarray, velocity: np.ndarray) -> float:
    across, _, up = position.std(axis=0)
    return across / up - 1.0


CASE = Case(
    truth="the period of a round column's lowest swing, ω² = 6 σ / (ρ R³)",
    source="Rayleigh 1879, Proc. R. Soc. 29, 71",
    unit="relative",
    run=run,
)
