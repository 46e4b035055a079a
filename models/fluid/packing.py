"""Where particles start: a jittered lattice in a cylinder, different for each seed."""

import numpy as np

TIGHTNESS = 0.97  # of the lattice, so that the wanted number fits below the surface
JITTER = 0.05  # sd of each coordinate, in spacings
TRIES = 6  # doublings of the lattice height: a wide stick leaves little room in each layer


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

    Raises:
        ValueError: the cylinder is too narrow for particles of this size.
    """
    layers = int(2.0 * particles / (np.pi * (radius / (TIGHTNESS * spacing)) ** 2)) + 4
    for _ in range(TRIES):
        points = _lattice(radius, spacing, layers, seed)
        free = np.hypot(points[:, 0], points[:, 1]) < radius - 0.4 * spacing
        free &= points[:, 2] > 0.2 * spacing
        if keep_out is not None:
            free &= ~keep_out(points)
        if free.sum() >= particles:
            points = points[free]
            lowest = np.argsort(points[:, 2], kind="stable")[:particles]
            return points[lowest].astype(np.float32)
        layers *= 2
    raise ValueError(
        f"{particles} particles {1e3 * spacing:.2g} mm apart do not fit into a cup of radius "
        f"{radius} m around its stick; use more, smaller particles"
    )


def _lattice(radius: float, spacing: float, layers: int, seed: int) -> np.ndarray:
    """Jittered points [n, 3] that cover the cylinder's cross-section, `layers` high."""
    rng = np.random.default_rng(seed)
    step = TIGHTNESS * spacing
    across = np.arange(-np.ceil(radius / step) - 1, np.ceil(radius / step) + 2)
    grid = np.meshgrid(across, across, np.arange(layers), indexing="ij")
    points = np.stack(grid, axis=-1).reshape(-1, 3)
    points[:, :2] += rng.uniform(size=2)
    turn = rng.uniform(0.0, 2.0 * np.pi)
    c, s = np.cos(turn), np.sin(turn)
    points[:, :2] @= np.array([[c, -s], [s, c]])
    return step * (points + [0.0, 0.0, 0.5] + JITTER * rng.standard_normal(points.shape))
