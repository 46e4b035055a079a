"""Liquid that turns in a cup while it gets warmer, or cooler, comes to rest by its viscosity."""

import numpy as np
from case import Case, CaseResult, Curve, Panel, Row
from scenes.still_cup import DENSITY, StillCup
from truths.cup_flows import swirl_decay

from .swirl_decay import swirl_over_time

CUP = StillCup(slippery_floor=True)
VISCOSITY = 0.5  # Pa s at the start
WARMING = np.array([-3.0, 0.0, 3.0])  # 1/s
SECONDS = 0.3
TOLERANCE = 0.02


def left(time: np.ndarray, warming: float) -> np.ndarray:
    """Share of the slowest mode that implicit steps leave, at their ends [s].

    Each multiplies it by 1 / (1 + rate dt), with the rate of its own middle.
    """
    viscosity = VISCOSITY * np.exp(-warming * (time - 0.5 * CUP.dt))
    rate = swirl_decay(CUP.radius, viscosity / DENSITY)
    return np.cumprod(1.0 / (1.0 + rate * CUP.dt))


def run(seed: int) -> CaseResult:
    """Mean rates of decay of the slowest mode."""
    viscosity = np.full(len(WARMING), VISCOSITY)
    time, seen = swirl_over_time(CUP, viscosity, SECONDS, seed, {"warming": WARMING})
    rows, curves = [], []
    for number, (warming, size) in enumerate(zip(WARMING, seen.T, strict=True)):
        exact = left(time, warming)
        # from the first step on: how fast the start is on the grid is no matter of viscosity
        truth, ours = (-np.log(one[-1] / one[0]) / (time[-1] - time[0]) for one in (exact, size))
        name = f"warming {warming:g} 1/s"
        rows.append(Row.relative(f"mean decay, {name} [1/s]", truth, ours, TOLERANCE))
        curves += [
            Curve(name, time, exact / exact[0], truth=True, series=number),
            Curve("", time, size / size[0], series=number),
        ]
    panel = Panel("time [s]", "size of the swirl / that at the start", tuple(curves), log="y")
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    truth="the slowest turning flow decays at ν(t) (3.83/R)², as implicit steps of that rate do",
    source="Batchelor 1967, section 4.5, with a viscosity that is the same everywhere",
    unit="relative",
    run=run,
)
