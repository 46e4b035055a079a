"""Two columns of different width that share a floor."""

import numpy as np
from case import Case, CaseResult, Curve, Panel, Row
from scenes.wet_box import Body, WetBox, WetLiquid, flow_in_box
from truths.menisci import mean_rise

CELL = 0.004
NARROW, WIDE, WALL = 0.024, 0.06, 2 * CELL  # m
UNDER, LEVEL = 0.008, 0.04  # m: where the wall between them ends, and the level at the start
BOX = WetBox(
    (NARROW + WALL + WIDE, 0.0, 0.08),
    CELL,
    block=((NARROW, 0.0, UNDER), (NARROW + WALL, 0.0, 1.0)),
)
LENGTH = 0.01  # m, capillary length: cells of 4 mm resolve it, weight is less than on earth
ANGLES = (30.0, 60.0, 90.0, 110.0)  # deg
VISCOSITY, DENSITY, TENSION = 0.2, 1000.0, 0.072
SECONDS, SETTLED = 6.0, 3.0
PACKINGS = 2  # of which levels are the mean: currents move a single one's by up to 1.3 mm
TOLERANCE = 1.2  # mm, 0.3 of a cell; the least rise or fall, without which it would fail, is 1.7


def run(seed: int) -> CaseResult:
    """Difference of the mean levels, while tension still drives small currents."""
    blocks = (
        ((0.0, 0.0, 0.0), (BOX.size[0], 0.0, UNDER)),
        ((0.0, 0.0, UNDER), (NARROW, 0.0, LEVEL)),
        ((NARROW + WALL, 0.0, UNDER), (BOX.size[0], 0.0, LEVEL)),
    )
    packings = [
        np.concatenate([BOX.fill(block, seed * PACKINGS + k + n) for n, block in enumerate(blocks)])
        for k in range(PACKINGS)
    ]
    area = BOX.size[0] * UNDER + (NARROW + WIDE) * (LEVEL - UNDER)
    weight = TENSION / DENSITY / LENGTH**2
    liquids = [
        WetLiquid(VISCOSITY, DENSITY, TENSION, np.radians(angle), (0.0, 0.0, -weight))
        for angle in ANGLES
    ]

    def look(position: np.ndarray, velocity: np.ndarray) -> float:
        over = position[position[:, 2] > UNDER, 0]
        each = area / len(position)
        narrow = (over < NARROW + 0.5 * WALL).sum() * each
        return narrow / NARROW - (len(over) * each - narrow) / WIDE

    bodies = [Body(points, area * CELL) for points in packings for _ in liquids]
    time, seen = flow_in_box(BOX, liquids * PACKINGS, bodies, SECONDS, look, every=10)
    seen = seen.reshape(len(time), PACKINGS, len(liquids)).mean(axis=1)
    rows, curves = [], []
    for k, angle in enumerate(ANGLES):
        radians = np.radians(angle)
        truth = mean_rise(NARROW, radians, LENGTH) - mean_rise(WIDE, radians, LENGTH)
        ours = seen[time > SETTLED, k].mean()
        name = f"the narrow column stands higher by, {angle:g} deg [mm]"
        rows.append(Row.absolute(name, 1e3 * float(truth), 1e3 * float(ours), TOLERANCE))
        curves += [
            Curve("", time[[0, -1]], [1e3 * float(truth)] * 2, truth=True, series=k),
            Curve(f"{angle:g} deg", time, 1e3 * seen[:, k], series=k),
        ]
    panel = Panel("time [s]", "difference of the levels [mm]", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    truth="levels differ by 2 σ cos a / (ρ g) (1/d1 - 1/d2)",
    source="Jurin 1718; de Gennes, Brochard-Wyart & Quéré 2004, section 2.4",
    unit="",
    run=run,
)
