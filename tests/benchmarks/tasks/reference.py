"""Exact posteriors on grids or scattered points, and how far another posterior is from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from .base import Task

CELLS = {1: 2000, 2: 200, 3: 64}  # along each axis, by dimension
COARSE = {1: 200, 2: 64, 3: 24}  # while the posterior is being looked for
ROUNDS = 30
SCATTERED = 60_000  # points where no grid resolves the posterior
KERNELS = 600  # about which these lie
NEIGHBOURS = 16  # whose covariance about it a kernel has
SCALES = (0.7, 0.7, 1.5, 4.0)  # of kernels' sds: posteriors that err are resolved, too
PRIOR_SHARE = 0.2  # of points that are draws of the prior
LEVEL = 0.9  # of the intervals whose coverage is scored


class Reference(NamedTuple):
    """The exact posterior on cells that cover the prior's box, finest where it is.

    Scattered points stand for cells, too: their volumes and masses are the weights by which draws
    of a mixture become draws of the prior and of the posterior.

    Attributes:
        points: Centres of the cells [n, d].
        volume: Prior mass of the cells [n]; sums to 1.
        mass: Exact posterior mass of the cells [n]; sums to 1.
    """

    points: np.ndarray
    volume: np.ndarray
    mass: np.ndarray


class Score(NamedTuple):
    """How far a posterior is from the exact one.

    Attributes:
        total_variation: Half the integral of the densities' absolute difference: 0 is equal,
            1 is disjoint.
        mean_error: Root mean square over parameters of the means' difference in exact sds.
        sd_ratio: Geometric mean over parameters of sd over exact sd.
        coverage: Exact posterior probability of the central 90 % intervals, mean over parameters:
            how often they hold the true parameter, were these data observed again and again.
    """

    total_variation: float
    mean_error: float
    sd_ratio: float
    coverage: float


def make_reference(task: Task, observed: np.ndarray, cells: int | None = None) -> Reference:
    """The exact posterior, on scattered points unless the task is gridded."""
    return _find_grid(task, observed, cells) if task.gridded else _scatter(task, observed)


def _find_grid(task: Task, observed: np.ndarray, cells: int | None) -> Reference:
    """Find the posterior on coarse grids, then evaluate it on a fine one.

    Cell widths grow with the distance from the posterior's mean, in proportion once that is
    beyond its sd: any other posterior that lies about the same place is resolved too, be it much
    wider.

    Args:
        task: Its log-likelihood is evaluated some ten times on the coarse grid.
        observed: The data.
        cells: Along each axis of the final grid.

    Raises:
        RuntimeError: the grids do not settle.
    """
    low, high = task.bounds.T
    mean, sd = (low + high) / 2.0, high - low
    for _ in range(ROUNDS):
        grid = _grid(task, observed, (mean, sd), COARSE[len(low)])
        new_mean, new_sd = _moments(grid)
        settled = (np.abs(new_sd / sd - 1.0) < 0.05).all() and (
            np.abs(new_mean - mean) < 0.1 * new_sd
        ).all()
        mean, sd = new_mean, new_sd
        if settled:
            return _grid(task, observed, (mean, sd), cells or CELLS[len(low)])
    raise RuntimeError(f"the posterior of {task.name} was not found in {ROUNDS} rounds of grids")


def _scatter(task: Task, observed: np.ndarray) -> Reference:
    """Importance sampling, from a mixture that follows the likelihood as its power rises to 1.

    Raises:
        RuntimeError: the power does not reach 1.
    """
    rng, (low, high) = np.random.default_rng(0), task.bounds.T
    points = rng.uniform(low, high, (SCATTERED, len(low)))
    volume, likelihood = np.full(SCATTERED, 1.0 / SCATTERED), task.log_likelihood
    for _ in range(ROUNDS):
        values = likelihood(observed, task.theta(points))
        power = _power(values, volume)
        mass = _normalised(power * values, volume)
        if power == 1.0 and 1.0 / np.sum(mass**2) > SCATTERED / 15:
            return Reference(points, volume, mass)
        points, volume = _mixture(rng, points, mass, task.bounds)
    raise RuntimeError(f"the posterior of {task.name} was not found in {ROUNDS} rounds of points")


def _power(values: np.ndarray, volume: np.ndarray) -> float:
    """The largest power of the likelihood, up to 1, that leaves many points their weight."""
    powers = np.append(np.geomspace(1e-12, 1.0, 300), 1.0)
    effective = [1.0 / np.sum(_normalised(p * values, volume) ** 2) for p in powers]
    return float(powers[np.flatnonzero(np.array(effective) > KERNELS / 2)[-1]])


def _mixture(
    rng: np.random.Generator, points: np.ndarray, mass: np.ndarray, bounds: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points [n, d] of kernels about draws of `points` and of the prior; their prior masses [n].

    A kernel has its neighbours' covariance, so that kernels follow ridges and modes.
    """
    n, d = SCATTERED, points.shape[1]
    mean = mass @ points
    scale = np.sqrt(mass @ (points - mean) ** 2)
    centres = points[rng.choice(len(points), KERNELS, replace=False, p=mass)] / scale
    nearest = np.argsort(cdist(centres, centres), axis=1)[:, 1 : NEIGHBOURS + 1]
    apart = centres[nearest] - centres[:, None]
    covariance = np.einsum("kni,knj->kij", apart, apart) / NEIGHBOURS + 1e-12 * np.eye(d)
    factors = np.linalg.cholesky(covariance) * np.resize(SCALES, KERNELS)[:, None, None]
    of = rng.integers(KERNELS, size=n)
    drawn = centres[of] + np.einsum("nij,nj->ni", factors[of], rng.standard_normal((n, d)))
    low, high = bounds.T / scale
    anywhere = rng.uniform(size=n) < PRIOR_SHARE
    drawn[anywhere] = rng.uniform(low, high, (n, d))[anywhere]
    drawn = drawn[((drawn >= low) & (drawn <= high)).all(axis=1)]
    density = np.zeros(len(drawn))
    for centre, factor in zip(centres, factors):  # noqa: B905  older Pythons
        white = np.linalg.inv(factor) @ (drawn - centre).T
        density += np.exp(-0.5 * np.sum(white**2, axis=0)) / np.prod(np.diag(factor))
    density *= np.prod(high - low) / KERNELS / (2.0 * np.pi) ** (d / 2)  # over the prior's
    volume = 1.0 / (PRIOR_SHARE + (1.0 - PRIOR_SHARE) * density)
    return drawn * scale, volume / volume.sum()


def score(log_density: np.ndarray, reference: Reference) -> Score:
    """Compare an unnormalised log posterior density at `reference.points` with the exact one.

    Args:
        log_density: [n], in the coordinates of the task, in which the prior is uniform.
        reference: Of the same data.

    Raises:
        ValueError: a value is NaN or +inf, or none is finite.
    """
    if np.isnan(log_density).any() or not np.isfinite(log_density.max()):
        raise ValueError("log densities must be finite or -inf, and not all -inf")
    mass = _normalised(log_density, reference.volume)
    mean, sd = mean_and_sd(reference.points, mass)
    exact_mean, exact_sd = mean_and_sd(reference.points, reference.mass)
    relative = (mean - exact_mean) / exact_sd
    return Score(
        total_variation=float(0.5 * np.abs(mass - reference.mass).sum()),
        mean_error=float(np.sqrt(np.mean(relative**2))),
        sd_ratio=float(np.exp(np.mean(np.log(sd / exact_sd)))),
        coverage=_coverage(reference, mass),
    )


def _coverage(reference: Reference, mass: np.ndarray) -> float:
    """Of the central intervals of level `LEVEL` under `mass`."""
    held = []
    for column in reference.points.T:
        values, place = np.unique(column, return_inverse=True)
        own, exact = (np.bincount(place, m, len(values)) for m in (mass, reference.mass))
        below, exactly = (np.cumsum(m) - 0.5 * m for m in (own, exact))
        ends = np.interp([(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0], below, values)
        held.append(np.ptp(np.interp(ends, values, exactly)))
    return float(np.mean(held))


def mean_and_sd(points: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of masses [n] at points [n, d]: each [d]."""
    mean = mass @ points
    return mean, np.sqrt(mass @ (points - mean) ** 2)


def _normalised(log_density: np.ndarray, volume: np.ndarray) -> np.ndarray:
    mass = np.exp(log_density - log_density.max()) * volume
    return mass / mass.sum()


def _grid(
    task: Task, observed: np.ndarray, place: tuple[np.ndarray, np.ndarray], cells: int
) -> Reference:
    edges = [
        _edges(low, high, mean, sd, cells)
        for (low, high), mean, sd in zip(task.bounds, *place)  # noqa: B905  older Pythons
    ]
    centres = np.meshgrid(*[(e[1:] + e[:-1]) / 2.0 for e in edges], indexing="ij")
    widths = np.meshgrid(*[np.diff(e) / (e[-1] - e[0]) for e in edges], indexing="ij")
    points = np.stack([c.ravel() for c in centres], axis=-1)
    volume = np.prod([w.ravel() for w in widths], axis=0)
    mass = _normalised(task.log_likelihood(observed, task.theta(points)), volume)
    return Reference(points, volume, mass)


def _edges(low: float, high: float, mean: float, sd: float, cells: int) -> np.ndarray:
    """Edges [cells + 1], equidistant in asinh((x - mean) / sd)."""
    first, last = np.arcsinh((low - mean) / sd), np.arcsinh((high - mean) / sd)
    edges = mean + sd * np.sinh(np.linspace(first, last, cells + 1))
    edges[[0, -1]] = low, high
    return edges


def _moments(grid: Reference) -> tuple[np.ndarray, np.ndarray]:
    """Mean and sd [d] of the grid's masses; the sd at least as wide as a cell at the mean."""
    mean, sd = mean_and_sd(grid.points, grid.mass)
    least = []
    for axis, middle in zip(grid.points.T, mean):  # noqa: B905  older Pythons
        centres = np.unique(axis)
        i = np.clip(np.searchsorted(centres, middle), 1, len(centres) - 1)
        least.append(centres[i] - centres[i - 1])
    return mean, np.maximum(sd, least)
