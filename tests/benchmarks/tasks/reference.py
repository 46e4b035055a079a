"""Exact posteriors on grids, and how far another posterior is from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .base import Task

CELLS = {1: 2000, 2: 200, 3: 64}  # along each axis, by dimension
COARSE = {1: 200, 2: 64, 3: 24}  # while the posterior is being looked for
ROUNDS = 30


class Reference(NamedTuple):
    """The exact posterior on cells that cover the prior's box, finest where it is.

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
        mean_error: Root mean square over parameters of the means' difference in prior widths.
        sd_ratio: Geometric mean over parameters of sd over exact sd.
    """

    total_variation: float
    mean_error: float
    sd_ratio: float


def make_reference(task: Task, observed: np.ndarray, cells: int | None = None) -> Reference:
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


def score(log_density: np.ndarray, reference: Reference, bounds: np.ndarray) -> Score:
    """Compare an unnormalised log posterior density at `reference.points` with the exact one.

    Args:
        log_density: [n], in the coordinates of the task, in which the prior is uniform.
        reference: Of the same data.
        bounds: Of the task's prior, [d, 2].

    Raises:
        ValueError: a value is NaN or +inf, or none is finite.
    """
    if np.isnan(log_density).any() or not np.isfinite(log_density.max()):
        raise ValueError("log densities must be finite or -inf, and not all -inf")
    mass = _normalised(log_density, reference.volume)
    mean, sd = mean_and_sd(reference.points, mass)
    exact_mean, exact_sd = mean_and_sd(reference.points, reference.mass)
    relative = (mean - exact_mean) / np.ptp(bounds, axis=1)
    return Score(
        total_variation=float(0.5 * np.abs(mass - reference.mass).sum()),
        mean_error=float(np.sqrt(np.mean(relative**2))),
        sd_ratio=float(np.exp(np.mean(np.log(sd / exact_sd)))),
    )


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
