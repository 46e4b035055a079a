"""A piece of a stream that falls freely, while it also moves sideways and turns."""

import numpy as np
from bolfi_liquids.models.apic.gravity import GRAVITY
from case import Case, CaseResult, Curve, Panel, Row
from scenes.wet_box import Body, WetBox, WetLiquid, flow_in_box
from truths.falling_stream import fall_speed

BOX = WetBox((0.12, 0.0, 0.24))
START = np.array([0.03, 0.0, 0.2])  # m
RADIUS = 0.012  # m
ASIDE, SPIN = 0.3, 20.0  # m/s, 1/s
SECONDS = 0.18
LIQUIDS = {
    "water": WetLiquid(0.001, 1000.0, 0.072),
    "water without tension": WetLiquid(0.001),
    "gel": WetLiquid(12.0, 1050.0, 0.05),
    "gel that turns": WetLiquid(12.0, 1050.0, 0.05),
}
TURNS = "gel that turns"
TOLERANCE, ASIDE_TOLERANCE, WIDTH_TOLERANCE, TURN_TOLERANCE = 0.01, 0.03, 0.05, 0.2


def run(seed: int) -> CaseResult:
    """Velocity and size of a round piece, and its turning."""
    block = tuple(START - RADIUS), tuple(START + RADIUS)
    points = BOX.fill(block, seed)
    points = points[np.hypot(*(points - START)[:, [0, 2]].T) < RADIUS]
    volume = np.pi * RADIUS**2 * BOX.cell
    around = (points - points.mean(axis=0)) @ np.array([[0, 0, -1.0], [0, 0, 0], [1.0, 0, 0]])
    aside = np.array([ASIDE, 0.0, 0.0])
    bodies = [
        Body(points, volume, aside + SPIN * around if name == TURNS else aside) for name in LIQUIDS
    ]

    def look(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        mean, flow = position.mean(axis=0), velocity.mean(axis=0)
        out, own = position - mean, velocity - flow
        width = np.sqrt(np.linalg.eigvalsh(np.cov(out[:, [0, 2]].T)))
        turn = (out[:, 2] * own[:, 0] - out[:, 0] * own[:, 2]).sum() / (out**2).sum()
        return np.r_[flow[[0, 2]], width / (0.5 * RADIUS), turn]

    time, seen = flow_in_box(BOX, list(LIQUIDS.values()), bodies, SECONDS, look)
    drop = 0.5 * GRAVITY * time[-1] ** 2
    down = fall_speed(0.0, drop)
    rows, curves = [], []
    for k, name in enumerate(LIQUIDS):
        last = seen[-1, k]
        rows += [
            Row.relative(f"speed down, {name} [m/s]", float(down), -last[1], TOLERANCE),
            Row.relative(f"speed aside, {name} [m/s]", ASIDE, last[0], ASIDE_TOLERANCE),
            Row.relative(f"least width, {name} [of the first]", 1.0, last[2], WIDTH_TOLERANCE),
            Row.relative(f"largest width, {name} [of the first]", 1.0, last[3], WIDTH_TOLERANCE),
        ]
        curves.append(Curve(name, time, seen[:, k, 0], series=k))
    turn = seen[:, list(LIQUIDS).index(TURNS), 4]
    rows.append(Row.relative("turn of the gel that turns [1/s]", SPIN, turn[-1], TURN_TOLERANCE))
    curves.append(Curve("as it began", time, np.full(len(time), ASIDE), truth=True))
    panel = Panel("time [s]", "speed aside [m/s]", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    truth="it falls as a stone, keeps its speed aside, its width and its turning",
    source="Galilei; conservation of momentum",
    unit="relative",
    run=run,
)
