"""What the cases of steady flow around the axis share.

Early rows see friction of the wall less than late ones. A mean of 0.45 s after the exact profile, a
wall without friction would have changed the angular momentum of liquid that is driven in proportion
to r by 24 ν t/R²: by a third at 0.05 Pa s, where 6 % is a fifth of the friction, and by more in
thicker liquids. The friction itself is judged by the case `swirl_decay`.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from case import CaseResult, Curve, Panel, Row
from scenes.still_cup import DENSITY, Flow, StillCup, around, flow_in_cup, swirl_of
from truths.cup_flows import driven_swirl

CUP = StillCup(slippery_floor=True)
VISCOSITY = np.array([0.05, 0.1, 0.3, 1.0, 5.0, 20.0])  # Pa s
SPEED = 0.05  # m/s, the fastest
SECONDS = 4.0
EARLY, LATE = (0.3, 0.6), (2.0, 4.0)  # s; when particles are in order, and when they are not
EARLY_TOLERANCE, TOLERANCE = 0.06, 0.15
RINGS = np.linspace(0.0, CUP.radius, 13)


class Tolerance(NamedTuple):
    """Of the late flow below a viscosity [Pa s], where the particles' agitation thickens it.

    Above, what cells hold fluctuates, and they are as thick as they are full: thinner on average.
    """

    below: float
    error: float


THIN = (Tolerance(0.07, 0.3), Tolerance(0.2, 0.2))


def compare(acceleration: Callable[[np.ndarray], np.ndarray], seed: int) -> CaseResult:
    """A swirl that is kept up by an acceleration around the axis, from its exact profile on.

    The size is that of the exact profile which is nearest in the mean square over particles.
    """

    def exact(r: np.ndarray) -> np.ndarray:
        speed = driven_swirl(np.r_[r, fine], acceleration, CUP.radius, 1.0)
        return SPEED * speed[: len(r)] / speed[len(r) :].max()

    def start(points: np.ndarray) -> np.ndarray:
        return around(points, exact(np.hypot(points[:, 0], points[:, 1])))

    def look(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        r, speed = swirl_of(position, velocity)
        truth = exact(r)
        count = np.histogram(r, RINGS)[0]
        rings = np.histogram(r, RINGS, weights=speed)[0] / np.maximum(count, 1)
        return np.r_[speed @ truth / (truth @ truth), rings]

    fine = np.linspace(0.0, CUP.radius, 200)
    strongest = driven_swirl(fine, acceleration, CUP.radius, 1.0).max()
    flow = Flow(start, acceleration, SPEED / strongest * VISCOSITY / DENSITY)
    time, seen = flow_in_cup(CUP, VISCOSITY, flow, SECONDS, look, seed)
    early, late = (
        seen[(time > begin) & (time <= end)].mean(axis=0) for begin, end in (EARLY, LATE)
    )
    rows = [
        Row.relative(f"swirl at {mu:g} Pa s, early", 1.0, size, EARLY_TOLERANCE)
        for mu, size in zip(VISCOSITY, early[:, 0], strict=True)
    ]
    rows += [
        Row.relative(f"swirl at {mu:g} Pa s, later", 1.0, size, _late_tolerance(mu))
        for mu, size in zip(VISCOSITY, late[:, 0], strict=True)
    ]
    middle = 1e3 * 0.5 * (RINGS[1:] + RINGS[:-1])
    curves = [Curve("exact", 1e3 * fine, exact(fine), truth=True)]
    curves += [
        Curve(f"{mu:g} Pa s", middle, rings, series=k)
        for k, (mu, rings) in enumerate(zip(VISCOSITY, late[:, 1:], strict=True))
    ]
    panel = Panel("distance from the axis [mm]", "speed around it [m/s]", tuple(curves))
    thinnest = VISCOSITY[0] / DENSITY * (1.0 / late[0, 0] - 1.0)
    notes = {"viscosity that the method adds, later, at 0.05 Pa s [m2/s]": float(thinnest)}
    return CaseResult(tuple(rows), (panel,), notes)


def _late_tolerance(viscosity: float) -> float:
    return next((thin.error for thin in THIN if viscosity < thin.below), TOLERANCE)
