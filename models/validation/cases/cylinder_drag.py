"""Drag of an upright rod in a stream, at the experiments' resolution and a finer one."""

import numpy as np

from ...fluid.liquid import Liquid
from ...fluid.numerics import COARSE, PUBLISHED_DRAG
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..scenes.stream import Stream, drag
from ..truths.cylinder_drag import DRAG_COEFFICIENT, drag_coefficient

RADIUS = 0.0045  # m, the stick's
DENSITY = 1000.0
REYNOLDS = np.array([1.0, 5.0, 20.0, 100.0])
SPEED = np.array([0.1, 0.1, 0.1, 0.3])  # m/s; slower, the last were thinner than particles flow
STREAMS = {
    "coarse": Stream(RADIUS, spacing=COARSE),
    "coarse, drag as published": Stream(RADIUS, spacing=COARSE, numerics=PUBLISHED_DRAG),
    "fine, drag as published": Stream(
        RADIUS, diameters=14.0, spacing=COARSE / 2, numerics=PUBLISHED_DRAG
    ),
}
SPAN = (1.0, 2.0)  # s
TOLERANCE = 0.25


def unconfined(force: np.ndarray, speed: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray]:
    """Speeds that an unconfined rod's drag is to be taken at [m/s], and coefficients.

    In a stream as wide as `side` the rod's wake, whose flux lacks Cd D U / 2, speeds up what goes
    by, at the rod's place by half of that (Glauert 1933, wake blockage).

    Args:
        force: Per length [N/m].
        speed: From the flux [m/s].
    """
    raw = force / (DENSITY * RADIUS * speed**2)
    faster = speed * (1.0 + raw * 2.0 * RADIUS / (4.0 * side))
    return faster, force / (DENSITY * RADIUS * faster**2)


def run(progress: Progress, seed: int) -> CaseResult:
    """Coefficients at each Reynolds number, of the speed that passes the rod."""
    viscosity = 2.0 * DENSITY * SPEED * RADIUS / REYNOLDS
    known, values = DRAG_COEFFICIENT.T
    seen = known >= 0.5 * REYNOLDS[0]
    rows, curves = [], [Curve("measured", known[seen], values[seen], truth=True)]
    for number, (name, stream) in enumerate(STREAMS.items()):
        found = drag(stream, Liquid(viscosity, 0.0, DENSITY), SPEED, SPAN, seed)
        speed, ours = unconfined(found.force, found.speed, stream.side)
        reynolds = 2.0 * DENSITY * speed * RADIUS / viscosity
        expected = drag_coefficient(reynolds)
        rows += [
            Row.relative(f"Cd at Re {re:.3g}, {name}", known_drag, our_drag, TOLERANCE)
            for re, known_drag, our_drag in zip(reynolds, expected, ours, strict=True)
        ]
        curves.append(Curve(name, reynolds, ours, series=number))
        progress((number + 1) / len(STREAMS))
    panel = Panel("Reynolds number", "drag coefficient", tuple(curves), log="xy")
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    name="cylinder_drag",
    title="Rod in a stream",
    truth="the drag of a long cylinder, for the speed that blockage makes of the stream's",
    source="Incompressible Flow, 4th ed., as fitted by Sharpe; blockage after Glauert 1933",
    unit="relative",
    tolerance=TOLERANCE,
    settings={
        "reynolds": REYNOLDS.tolist(),
        "speed": SPEED.tolist(),
        "spacing": [stream.spacing for stream in STREAMS.values()],
        "diameters": [stream.diameters for stream in STREAMS.values()],
        "span": SPAN,
    },
    run=run,
)
