"""Quasi-Newton minimisation of many small problems at once, and of one over the unit box.

With SciPy's L-BFGS-B, one problem after the other, hyperparameters of eight processes took longer:
its overhead an iteration exceeds the evaluation.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.special import expit, logit

from ..sobol import sobol
from .process import GP, predict

SCREENED_POINTS, REFINED_POINTS = 512, 3
BOX_EDGE = 1e-6  # the box is [BOX_EDGE, 1 - BOX_EDGE]: beyond lie only tails of unbounded priors
MAX_ITERATIONS, MAX_BACKTRACKS = 40, 8
LONGEST_STEP = 1.0  # of a step, in every coordinate
ARMIJO = 1e-4
DIFFERENCE = 1e-5  # half the distance of the points of a central difference

Objective = Callable[[np.ndarray], np.ndarray]
"""u [n, d] -> values [n]."""
ValueAndGrad = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""x [m, d] and which problems these are, int [m] -> values [m], gradients [m, d]."""


def minimise_many(
    value_and_grad: ValueAndGrad, start: np.ndarray, tolerance: float = 1e-3
) -> tuple[np.ndarray, np.ndarray]:
    """BFGS on k independent problems in step, so that they share each evaluation's overhead.

    Nocedal and Wright (2006), eq. 6.17, with backtracking.

    Args:
        start: [k, d].
        tolerance: A problem is done when an iteration gains less.

    Returns:
        The best points [k, d] and their values [k]; infinite where nothing was finite.
    """
    x = np.array(start, np.float64)
    k, d = x.shape
    now = Points(x, *_evaluate(value_and_grad, x, np.arange(k)))
    steep = np.maximum(1.0, np.sqrt(np.sum(now.gradient**2, 1)))
    inverse = np.tile(np.eye(d), (k, 1, 1)) / steep[:, None, None]
    active = np.isfinite(now.value)
    for _ in range(MAX_ITERATIONS):
        if not active.any():
            break
        step = -np.einsum("kij,kj->ki", inverse, now.gradient)
        step /= np.maximum(1.0, np.abs(step).max(1, keepdims=True) / LONGEST_STEP)
        moved = _search(value_and_grad, now, step, active)
        change, turn = moved.x - now.x, moved.gradient - now.gradient
        gain = np.subtract(now.value, moved.value, where=active, out=np.zeros(k))
        inverse = _update(inverse, change, turn)
        now = moved
        active &= gain > tolerance
    return now.x, now.value


class Points(NamedTuple):
    """Positions, values and gradients of k searches."""

    x: np.ndarray  # [k, d]
    value: np.ndarray  # [k]
    gradient: np.ndarray  # [k, d]


def _evaluate(
    value_and_grad: ValueAndGrad, x: np.ndarray, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    value, gradient = value_and_grad(x, rows)
    bad = ~(np.isfinite(value) & np.isfinite(gradient).all(1))
    return np.where(bad, np.inf, value), np.where(bad[:, None], 0.0, gradient)


def _search(
    value_and_grad: ValueAndGrad, now: Points, step: np.ndarray, active: np.ndarray
) -> Points:
    """Backtrack until every active problem has gained enough; those that cannot stay."""
    slope = np.sum(step * now.gradient, 1)
    best = Points(*(part.copy() for part in now))
    rows, length = np.flatnonzero(active), 1.0
    for _ in range(MAX_BACKTRACKS):
        trial = now.x[rows] + length * step[rows]
        new = Points(trial, *_evaluate(value_and_grad, trial, rows))
        enough = new.value <= now.value[rows] + ARMIJO * length * slope[rows]
        for kept, found in zip(best, new, strict=True):
            kept[rows[enough]] = found[enough]
        rows, length = rows[~enough], length * 0.3
        if not len(rows):
            break
    return best


def _update(inverse: np.ndarray, change: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """BFGS update of the inverse Hessians [k, d, d] where the curvature is positive."""
    curvature = np.sum(change * turn, 1)
    valid = curvature > 1e-12
    rho = np.where(valid, 1.0 / np.where(valid, curvature, 1.0), 0.0)[:, None, None]
    left = np.eye(change.shape[1]) - rho * change[:, :, None] * turn[:, None, :]
    updated = left @ inverse @ np.swapaxes(left, 1, 2)
    return updated + rho * change[:, :, None] * change[:, None, :]


def minimise_in_box(
    objective: Objective,
    dimension: int,
    low: np.ndarray | float = 0.0,
    high: np.ndarray | float = 1.0,
) -> np.ndarray:
    """Global minimiser u [dimension]: quasi-Newton from the best of a Sobol screen.

    Of a fixed screen the best few points are refined, over unbounded coordinates x with
    u = low + (high - low) / (1 + exp(-x)). The result is a pure function of objective and box.

    Args:
        low, high: The box, in the unit box [dimension].
    """
    first, last = (np.broadcast_to(np.asarray(end, float), dimension) for end in (low, high))
    size = last - first
    screen = sobol(0, 0, SCREENED_POINTS, dimension)
    order = np.argsort(objective(first + size * screen))[:REFINED_POINTS]
    one = np.eye(dimension)
    steps = DIFFERENCE * np.concatenate([np.zeros((1, dimension)), one, -one])

    def value_and_grad(x: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        around = first + size * expit(x[:, None, :] + steps)
        values = objective(around.reshape(-1, dimension)).reshape(len(x), -1)
        above, below = values[:, 1 : dimension + 1], values[:, dimension + 1 :]
        return values[:, 0], (above - below) / (2.0 * DIFFERENCE)

    x, value = minimise_many(value_and_grad, logit(screen[order]), tolerance=1e-6)
    return np.clip(first + size * expit(x[np.argmin(value)]), BOX_EDGE, 1.0 - BOX_EDGE)


def surely_least(gp: GP) -> np.ndarray:
    """Where the mean of one process is surely low: minimiser u [d] of mean + sd.

    The mean alone may be least in a corner where nothing was simulated.
    """

    def surely(u: np.ndarray) -> np.ndarray:
        (mean,), (variance,) = predict(gp, u)
        return mean + np.sqrt(variance)

    return minimise_in_box(surely, gp.data.u.shape[1])
