"""Where particles start: a jittered lattice in a cylinder, different for each seed."""

import numpy as np
from numpy.typing import ArrayLike

TIGHTNESS = 0.97  # of the lattice, so that the wanted number fits below the surface
JITTER = 0.05  # sd of each coordinate, in spacings


def pack_cylinder(
    radius: float, spacing: float, particles: int, seed: int, keep_out=None
) -> np.ndarray:
    """Lattice points in an upright cylinder on z = 0, from the floor up, turned by chance.

    Args:
        radius: Inner radius of the cylinder [m].
        spacing: Particle spacing [m].
        particles: Points wanted.
        seed: Decides the lattice's turn, offset and jitter.
        keep_out: Optional function of points [n, 3] that is True where none may lie.

    Returns:
        Positions [m], shape [particles, 3].
    """
    rng = np.random.default_rng(seed)
    step = TIGHTNESS * spacing
    across = np.arange(-np.ceil(radius / step) - 1, np.ceil(radius / step) + 2)
    per_layer = np.pi * (radius / step) ** 2
    layers = np.arange(int(2.0 * particles / per_layer) + 4)
    points = np.stack(np.meshgrid(across, across, layers, indexing="ij"), axis=-1).reshape(-1, 3)
    points[:, :2] += rng.uniform(size=2)
    turn = rng.uniform(0.0, 2.0 * np.pi)
    c, s = np.cos(turn), np.sin(turn)
    points[:, :2] @= np.array([[c, -s], [s, c]])
    points = step * (points + [0.0, 0.0, 0.5] + JITTER * rng.standard_normal(points.shape))
    free = np.hypot(points[:, 0], points[:, 1]) < radius - 0.4 * spacing
    free &= points[:, 2] > 0.2 * spacing
    if keep_out is not None:
        free &= ~keep_out(points)
    points = points[free]
    lowest = np.argsort(points[:, 2], kind="stable")[:particles]
    return points[lowest].astype(np.float32)


def checked_seeds(seeds: ArrayLike) -> np.ndarray:
    """Seeds as an array of shape [B].

    Raises:
        ValueError: there is none, or one is no integer or negative.
    """
    array = np.atleast_1d(np.asarray(seeds))
    if array.size == 0 or array.ndim > 1 or array.dtype.kind not in "iu" or (array < 0).any():
        raise ValueError(f"seeds must be integers of at least 0, one a simulation, got {seeds}")
    return array
