"""Liquid that turns in a cup comes to rest by its viscosity."""

from collections.abc import Mapping

import numpy as np
from case import Case, CaseResult, Curve, Panel, Row
from scenes.still_cup import DENSITY, Flow, StillCup, around, flow_in_cup, swirl_of
from truths.cup_flows import implicit_rate, swirl_decay, swirl_mode

CUPS = (StillCup(slippery_floor=True), StillCup(radius=0.043, slippery_floor=True))
"""The second cup's wall lies otherwise in the cells."""
VISCOSITY = np.array([0.05, 0.1, 0.3, 1.0, 2.0, 5.0, 10.0, 20.0])  # Pa s
SPEED = 0.05  # m/s, the fastest at the start
SECONDS = 0.6
LEFT = 0.05  # of the speed, below which the solver's tolerance decides
THIN, THIN_SECONDS, SETTLED = 0.001, 2.0, 0.5  # Pa s, s, s
TOLERANCE, THINNEST_TOLERANCE = 0.05, 0.1


def swirl_over_time(
    cup: StillCup,
    viscosity: np.ndarray,
    seconds: float,
    seed: int,
    effects: Mapping[str, np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and the size of the slowest mode [m/s], shape [steps, B], from that mode on."""

    def start(points: np.ndarray) -> np.ndarray:
        mode = swirl_mode(np.hypot(points[:, 0], points[:, 1]), cup.radius)
        return around(points, SPEED * mode)

    def look(position: np.ndarray, velocity: np.ndarray) -> float:
        r, speed = swirl_of(position, velocity)
        mode = swirl_mode(r, cup.radius)
        return float(speed @ mode / (mode @ mode))

    return flow_in_cup(cup, viscosity, Flow(start, effects=effects or {}), seconds, look, seed)


def decay(time: np.ndarray, size: np.ndarray) -> float:
    """Rate [1/s] until a small part is left."""
    faded = np.flatnonzero(size < LEFT * size[0])
    until = max(faded[0], 2) if len(faded) else len(size)
    return float(-np.polyfit(time[:until], np.log(size[:until]), 1)[0])


def run(seed: int) -> CaseResult:
    """Rates against those of implicit steps: at 20 Pa s a step is longer than the decay."""
    rows, curves = [], []
    for number, cup in enumerate(CUPS):
        time, size = swirl_over_time(cup, VISCOSITY, SECONDS, seed)
        ours = np.array([decay(time, one) for one in size.T])
        exact = swirl_decay(cup.radius, VISCOSITY / DENSITY)
        expected = implicit_rate(exact, cup.dt)
        rows += [
            Row.relative(
                f"decay at {mu:g} Pa s, cup of {1e3 * cup.radius:g} mm [1/s]",
                truth,
                rate,
                THINNEST_TOLERANCE if mu == VISCOSITY[0] else TOLERANCE,
            )
            for mu, truth, rate in zip(VISCOSITY, expected, ours, strict=True)
        ]
        name = f"{1e3 * cup.radius:g} mm"
        curves += [
            Curve(f"implicit steps, {name}", VISCOSITY, expected, truth=True, series=number),
            Curve(f"simulated, {name}", VISCOSITY, ours, series=number),
        ]
    panel = Panel("viscosity [Pa s]", "rate of decay [1/s]", tuple(curves), log="xy")
    return CaseResult(tuple(rows), (panel,), _added_viscosity(seed))


def _added_viscosity(seed: int) -> dict[str, float]:
    """What the method adds to a thin liquid's viscosity [m²/s], at first and later."""
    cup = CUPS[0]
    time, size = swirl_over_time(cup, np.array([THIN]), THIN_SECONDS, seed)
    first = time <= SETTLED
    unit = float(swirl_decay(cup.radius, 1.0))
    names = f"added viscosity in {THIN:g} Pa s, first {SETTLED:g} s [m2/s]", "the same, later"
    return {
        name: -float(np.polyfit(time[part], np.log(size[part, 0]), 1)[0]) / unit - THIN / DENSITY
        for name, part in zip(names, (first, ~first), strict=True)
    }


CASE = Case(
    truth="the slowest turning flow decays at ν (3.83/R)², as implicit steps of that rate do",
    source="Batchelor 1967, section 4.5; the floor does not rub",
    unit="relative",
    run=run,
)
