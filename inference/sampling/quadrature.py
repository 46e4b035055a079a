"""The posterior of one or two parameters by adaptive quadrature: no Markov chain involved.

The box of prior quantiles is cut into cells, and those halved along each axis whose mass is
large and uneven, until it is even enough or the budget is spent. Each cell counts as flat.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.special import softmax

from .target import LOG_ZERO, Chains, Length, Target, log_likelihood, somewhere_finite

FIRST_GRID = {1: 256, 2: 32}  # cells along each axis at first
CELL_TOLERANCE = 2e-5  # of a cell's error: its share of the mass, at most, times its unevenness^2
MIN_CELL_WIDTH = 2.0**-30  # width of a cell that is not divided any more
QUICK_BUDGET, THOROUGH_BUDGET = 8192, 32768  # evaluations to check a sampler with, and to draw from
BINS = 16
VARIATION_SLACK = 0.02  # total variation that cells and finite autocorrelation may add


class Quadrature(NamedTuple):
    """n cells that fill the box."""

    low: np.ndarray  # [n, d], prior quantiles
    width: np.ndarray  # [n]
    mass: np.ndarray  # [n], sums to one
    log_likelihood: np.ndarray  # [n], at the centres


class _Cells(NamedTuple):
    low: np.ndarray
    width: np.ndarray
    value: np.ndarray  # log likelihood at the centre
    uneven: np.ndarray  # by how much it may differ elsewhere in the cell


def integrate(target: Target, budget: int = QUICK_BUDGET) -> Quadrature:
    """Cut the box.

    Modes need not be known, but to be found they must show on the first grid: as a slope of
    the log likelihood, however small the likelihood itself. Where it is not finite it counts
    as zero; the edge of such a hole takes most of the budget.

    Args:
        target: Of one or two parameters.
        budget: Evaluations of the likelihood, at least those of the first grid (256 or
            1024); finished earlier where all is even.

    Raises:
        ValueError: more than two parameters, or a log likelihood that is finite nowhere.
    """
    d = target.dimension
    if d not in FIRST_GRID:
        raise ValueError(
            f"quadrature needs one or two parameters, got {d}; sample with 'nuts' or 'emcee'"
        )
    cells = _first(target)
    spent = len(cells.value)
    while True:
        chosen = _worth_dividing(cells, (budget - spent) // 2**d)
        if len(chosen) == 0:
            break
        children = _divided(target, _Cells(*(part[chosen] for part in cells)))
        spent += len(children.value)
        kept = np.delete(np.arange(len(cells.value)), chosen)
        cells = _Cells(
            *(np.concatenate([a[kept], b]) for a, b in zip(cells, children, strict=True))
        )
    log_mass = cells.value + d * np.log(cells.width)
    return Quadrature(cells.low, cells.width, softmax(log_mass), cells.value)


def _first(target: Target) -> _Cells:
    d, n = target.dimension, FIRST_GRID[target.dimension]
    axis = np.arange(n) / n
    low = np.stack(np.meshgrid(*[axis] * d, indexing="ij"), -1).reshape(-1, d)
    value = somewhere_finite(_finite(target, low + 0.5 / n))
    grid = value.reshape([n] * d)
    uneven = np.zeros_like(grid)
    for j in range(d):
        step = np.abs(np.diff(grid, axis=j))
        edge = np.zeros_like(np.take(step, [0], axis=j))
        before = np.concatenate([edge, step], axis=j)
        after = np.concatenate([step, edge], axis=j)
        uneven = np.maximum(uneven, np.maximum(before, after))
    return _Cells(low, np.full(len(low), 1.0 / n), value, uneven.ravel())


def _worth_dividing(cells: _Cells, most: int) -> np.ndarray:
    """Indices of the cells with the largest errors above CELL_TOLERANCE, at most `most`."""
    log_mass = cells.value + cells.low.shape[1] * np.log(cells.width)
    shifted = log_mass - log_mass.max()
    total = np.exp(shifted).sum()
    # as if the whole cell were as high as its highest point may be
    share = np.exp(np.minimum(shifted + cells.uneven - np.log(total), 0.0))
    error = np.where(cells.width > MIN_CELL_WIDTH, share * np.minimum(cells.uneven, 1.0) ** 2, 0.0)
    order = np.argsort(-error)[: max(most, 0)]
    return order[error[order] > CELL_TOLERANCE]


def _divided(target: Target, parents: _Cells) -> _Cells:
    """All halves (quarters) of the parents."""
    d = target.dimension
    half = 0.5 * parents.width
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * d, indexing="ij"), -1).reshape(-1, d)
    low = parents.low[:, None] + corners * half[:, None, None]
    value = _finite(target, (low + 0.5 * half[:, None, None]).reshape(-1, d))
    value = value.reshape(len(half), -1)
    # the slope that takes the parent's centre to a child's takes this to its corner
    uneven = np.abs(value - parents.value[:, None]).max(1)
    count = value.shape[1]
    return _Cells(
        low.reshape(-1, d), np.repeat(half, count), value.ravel(), np.repeat(uneven, count)
    )


def _finite(target: Target, u: np.ndarray) -> np.ndarray:
    """Log likelihood [n] at u [n, d]; LOG_ZERO where it is not finite."""
    values = log_likelihood(target, u)
    return np.where(np.isfinite(values), values, LOG_ZERO)


def draw(rng: np.random.Generator, cells: Quadrature, n: int) -> tuple[np.ndarray, np.ndarray]:
    """n independent draws u [n, d] and the log likelihoods [n] of their cells."""
    cumulated = np.cumsum(cells.mass)
    chosen = np.searchsorted(cumulated, rng.random(n) * cumulated[-1])
    chosen = np.minimum(chosen, len(cumulated) - 1)
    inside = rng.random((n, cells.low.shape[1]))
    return cells.low[chosen] + cells.width[chosen, None] * inside, cells.log_likelihood[chosen]


def sample_quadrature(rng: np.random.Generator, target: Target, length: Length) -> Iterator[Chains]:
    """Independent draws, without warm-up.

    Yields:
        `length.draws` draws for each chain, without end.

    Raises:
        ValueError: more than two parameters.
    """
    cells = integrate(target, THOROUGH_BUDGET)
    shape = (length.chains, length.draws)
    while True:
        u, values = draw(rng, cells, length.chains * length.draws)
        yield Chains(u.reshape(*shape, -1), {"lp": values.reshape(shape)})


def total_variation(u: np.ndarray, cells: Quadrature) -> float:
    """Distance of draws u [n, d] from the quadrature, binned into BINS equally probable bins:
    intervals, or four slices along the first axis, each cut into four along the second."""
    if u.shape[1] == 1:
        counts = _counts(u[:, 0], _quantiles(cells.low[:, 0], cells.width, cells.mass, BINS))
        return _distance(counts, len(u))
    side = int(np.sqrt(BINS))
    slices = _quantiles(cells.low[:, 0], cells.width, cells.mass, side)
    within = np.searchsorted(slices, u[:, 0])
    bounds = np.concatenate([[0.0], slices, [1.0]])
    counts = []
    for i in range(side):
        left, right = bounds[i], bounds[i + 1]
        low, width = cells.low[:, 0], cells.width
        overlap = np.clip(np.minimum(low + width, right) - np.maximum(low, left), 0.0, None)
        edges = _quantiles(cells.low[:, 1], width, cells.mass * overlap / width, side)
        counts.append(_counts(u[within == i, 1], edges))
    return _distance(np.concatenate(counts), len(u))


def largest_expected(effective: float) -> float:
    """Total variation that `effective` independent draws stay below: twice its mean, some five
    of its standard deviations beyond that, plus VARIATION_SLACK."""
    p = 1.0 / BINS
    mean = 0.5 * BINS * np.sqrt(2.0 * p * (1.0 - p) / (np.pi * max(effective, 1.0)))
    return float(2.0 * mean + VARIATION_SLACK)


def _distance(counts: np.ndarray, n: int) -> float:
    return float(0.5 * np.abs(counts / n - 1.0 / BINS).sum())


def _counts(values: np.ndarray, inner_edges: np.ndarray) -> np.ndarray:
    return np.bincount(np.searchsorted(inner_edges, values), minlength=len(inner_edges) + 1)


def _cdf(low: np.ndarray, width: np.ndarray, mass: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Cumulated mass of flat cells below each of `at` [m]."""
    starts, ends = np.sort(low), np.sort(low + width)
    slope = mass / width
    # sum of mass * clip((at - low) / width, 0, 1) = ramps that begin minus ramps that end
    by_start, by_end = np.argsort(low), np.argsort(low + width)
    total = np.zeros(len(at))
    for points, order, sign in ((starts, by_start, 1.0), (ends, by_end, -1.0)):
        rate = np.concatenate([[0.0], np.cumsum(slope[order])])
        moment = np.concatenate([[0.0], np.cumsum(slope[order] * points)])
        below = np.searchsorted(points, at)
        total += sign * (rate[below] * at - moment[below])
    return total


def _quantiles(low: np.ndarray, width: np.ndarray, mass: np.ndarray, parts: int) -> np.ndarray:
    """Inner edges [parts - 1] that cut the mass into equal parts."""
    edges = np.unique(np.concatenate([low, low + width]))
    below = np.maximum.accumulate(_cdf(low, width, mass, edges))
    return np.interp(np.arange(1, parts) / parts * below[-1], below, edges)
