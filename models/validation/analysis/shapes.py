"""Where particles are: fronts, heights, shapes and pieces of a liquid."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree


class DensityProfile(NamedTuple):
    """Particle density by height, all [n].

    Attributes:
        height: Middle of each slab [m].
        density: Particles' volume over the slab's; 1 at rest density.
    """

    height: np.ndarray
    density: np.ndarray


def front_position(
    positions: ArrayLike, spacing: float, *, axis: int = 0, strays: int = 3
) -> np.ndarray:
    """How far a liquid has come along an axis [m]: half a spacing beyond its foremost centres.

    Args:
        positions: Particle centres [m], shape [..., n, 3].
        spacing: Particle spacing [m].
        axis: Along which it spreads.
        strays: Foremost particles that do not count, as spray runs ahead of the front.

    Returns:
        Shape [...].

    Raises:
        ValueError: there are no more particles than strays.
    """
    along = np.asarray(positions, float)[..., axis]
    if along.shape[-1] <= strays:
        raise ValueError(f"{along.shape[-1]} particles have no front behind {strays} strays")
    return np.partition(along, -strays - 1, axis=-1)[..., -strays - 1] + 0.5 * spacing


def column_height(
    positions: ArrayLike, spacing: float, reach: float, *, axis: int = 0, strays: int = 3
) -> np.ndarray:
    """Height [m] of the liquid within `reach` [m] of the wall at 0; z is up.

    Shapes as `front_position`; NaN where no more than `strays` particles are left there.
    """
    positions = np.asarray(positions, float)
    height = np.where(positions[..., axis] < reach, positions[..., 2], -np.inf)
    top = np.partition(height, -strays - 1, axis=-1)[..., -strays - 1] + 0.5 * spacing
    return np.where(np.isfinite(top), top, np.nan)


def principal_moment_ratio(positions: ArrayLike) -> np.ndarray:
    """Shortest over longest principal axis of a cloud of particles: 1 for a ball or a cube.

    The root of the ratio of the extreme eigenvalues of the covariance.

    Args:
        positions: [m], shape [..., n, 3].

    Returns:
        Shape [...], from 0 to 1.
    """
    positions = np.asarray(positions, float)
    centred = positions - positions.mean(axis=-2, keepdims=True)
    moments = np.linalg.eigvalsh(np.swapaxes(centred, -1, -2) @ centred)
    return np.sqrt(np.maximum(moments[..., 0], 0.0) / moments[..., -1])


def roundness(positions: ArrayLike) -> np.ndarray:
    """Mean of x⁴ + y⁴ + z⁴ over the squared mean of r²: 0.59 for a cube, 5/7 for a ball.

    What `principal_moment_ratio` cannot tell apart. The cube's faces are across the axes.
    """
    positions = np.asarray(positions, float)
    centred = positions - positions.mean(axis=-2, keepdims=True)
    squares = np.mean(np.sum(centred**2, axis=-1), axis=-1)
    return np.mean(np.sum(centred**4, axis=-1), axis=-1) / squares**2


def cluster_sizes(positions: ArrayLike, reach: float) -> np.ndarray:
    """Particles in each connected piece, largest first; neighbours are within `reach` [m].

    Args:
        positions: [m], shape [n, 3].
    """
    positions = np.asarray(positions, float)
    n = len(positions)
    pairs = KDTree(positions).query_pairs(reach, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs), bool), tuple(pairs.T)), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    return np.sort(np.bincount(label))[::-1]


def count_clusters(positions: ArrayLike, reach: float, smallest: int = 1) -> int:
    """Connected pieces of at least `smallest` particles; see `cluster_sizes`."""
    return int((cluster_sizes(positions, reach) >= smallest).sum())


def density_by_height(
    positions: ArrayLike, spacing: float, area: float, slab: float
) -> DensityProfile:
    """Density relative to rest in slabs of thickness `slab` [m] above z = 0.

    Args:
        positions: [m], shape [n, 3].
        spacing: A particle's volume is its cube [m].
        area: Of the vessel [m²].
    """
    z = np.asarray(positions, float)[:, 2]
    slabs = max(1, int(np.ceil(z.max() / slab)))
    count, edges = np.histogram(z, slabs, (0.0, slabs * slab))
    return DensityProfile(0.5 * (edges[1:] + edges[:-1]), count * spacing**3 / (area * slab))
