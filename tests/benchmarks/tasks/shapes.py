"""two_moons, gaussian_mixture and slcp: few numbers, posteriors of difficult shape.

Those of sbibm (Lueckmann et al. 2021, arXiv:2101.04653, T.8, T.7, T.3), observed at the parameters
of its first observations.
"""

from __future__ import annotations

import numpy as np

from .base import Task, Theta

RADIUS, WIDTH = 0.1, 0.01  # of a moon
SDS = np.array([1.0, 0.1])  # of the mixture's halves
FLOOR = 1e-6  # of slcp's variances
POINTS = 4  # of slcp
MOON = {"t1": -0.8176656, "t2": -0.5756806}
MIXTURE = {"t1": -9.527071, "t2": -1.4817104}
COMPLEX = {"t1": 0.7, "t2": -2.9, "t3": -1.0, "t4": -0.9, "t5": 0.6}


def generators(seeds: np.ndarray) -> list[np.random.Generator]:
    return [np.random.default_rng(int(seed)) for seed in seeds]


def two(theta: Theta) -> np.ndarray:
    """[b, 2]"""
    return np.stack([theta["t1"], theta["t2"]], axis=-1)


def corner(theta: Theta) -> np.ndarray:
    """Where a moon's circle has its middle, [b, 2]."""
    t1, t2 = theta["t1"], theta["t2"]
    return np.stack([0.25 - np.abs(t1 + t2) / np.sqrt(2.0), (t2 - t1) / np.sqrt(2.0)], axis=-1)


def moons(theta: Theta, seeds: np.ndarray) -> np.ndarray:
    """A point of half a circle, [b, 2]."""
    drawn = [(g.uniform(-np.pi / 2, np.pi / 2), g.normal(RADIUS, WIDTH)) for g in generators(seeds)]
    angle, radius = np.array(drawn).T
    return corner(theta) + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def moon_density(observed: np.ndarray, theta: Theta) -> np.ndarray:
    """In polar coordinates about the circle's middle; radii below 0 are 10 sds away."""
    x, y = (observed - corner(theta)).T
    radius = np.hypot(x, y)
    return np.where(x < 0.0, -np.inf, -0.5 * ((radius - RADIUS) / WIDTH) ** 2 - np.log(radius))


def mixture(theta: Theta, seeds: np.ndarray) -> np.ndarray:
    """[b, 2]"""
    return two(theta) + [SDS[g.integers(2)] * g.standard_normal(2) for g in generators(seeds)]


def mixture_density(observed: np.ndarray, theta: Theta) -> np.ndarray:
    squares = np.sum((observed - two(theta)) ** 2, axis=1)
    return np.logaddexp(*(-0.5 * squares / sd**2 - 2.0 * np.log(sd) for sd in SDS))


def covariance(theta: Theta) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Variances of the first and second coordinate and their covariance, each [b]."""
    first, second = theta["t3"] ** 2, theta["t4"] ** 2
    return first**2 + FLOOR, second**2 + FLOOR, np.tanh(theta["t5"]) * first * second


def points(theta: Theta, seeds: np.ndarray) -> np.ndarray:
    """Four draws of a normal distribution, [b, 4, 2]."""
    xx, yy, xy = covariance(theta)
    sd = np.sqrt(xx)
    z = np.stack([g.standard_normal((POINTS, 2)) for g in generators(seeds)])
    x = sd[:, None] * z[..., 0]
    y = (xy / sd)[:, None] * z[..., 0] + np.sqrt(yy - xy**2 / xx)[:, None] * z[..., 1]
    return two(theta)[:, None] + np.stack([x, y], axis=-1)


def points_density(observed: np.ndarray, theta: Theta) -> np.ndarray:
    xx, yy, xy = covariance(theta)
    determinant = xx * yy - xy**2
    x, y = np.moveaxis(observed[:, None] - two(theta), -1, 0)  # [4, b] each
    squares = np.sum(yy * x**2 - 2.0 * xy * x * y + xx * y**2, axis=0) / determinant
    return -0.5 * (squares + POINTS * np.log(determinant))


def statistics(signals: np.ndarray) -> np.ndarray:
    """Means, log sds and arctanh of the correlation, [b, 5]: sufficient."""
    mean, sd = signals.mean(axis=1), signals.std(axis=1)
    product = np.prod(signals - mean[:, None], axis=-1).mean(axis=1)
    correlation = product / np.prod(sd, axis=1)
    return np.column_stack([mean, np.log(sd), np.arctanh(correlation)])


def statistics_apart(observed: np.ndarray, simulated: np.ndarray) -> float:
    """Euclidean distance of the statistics."""
    return float(np.linalg.norm(np.diff(statistics(np.stack([observed, simulated])), axis=0)))


def at(simulate, truth):
    """The observations of `simulate` at `truth`: seed -> data."""
    theta = {name: np.array([value]) for name, value in truth.items()}
    return lambda seed: simulate(theta, np.array([seed]))[0]


TWO_MOONS = Task(
    name="two_moons",
    ranges={"t1": (-1.0, 1.0), "t2": (-1.0, 1.0)},
    simulate=moons,
    observe=at(moons, MOON),
    log_likelihood=moon_density,
    gridded=False,
)
GAUSSIAN_MIXTURE = Task(
    name="gaussian_mixture",
    ranges={"t1": (-10.0, 10.0), "t2": (-10.0, 10.0)},
    simulate=mixture,
    observe=at(mixture, MIXTURE),
    log_likelihood=mixture_density,
)
SLCP = Task(
    name="slcp",
    ranges=dict.fromkeys(COMPLEX, (-3.0, 3.0)),
    simulate=points,
    observe=at(points, COMPLEX),
    log_likelihood=points_density,
    discrepancy=statistics_apart,
    view=statistics,
    gridded=False,
)
