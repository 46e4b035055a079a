"""The line of nodes that a stick is to the liquid, and the constants of its law of slip."""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

# Numbers, the same for all liquids, cells and steps; `tests/benchmarks/slip_constants.py` shows how
# the error of reference recordings depends on those from QUADRATIC to HELD_RADIUS.
QUADRATIC = 1.7  # slip: force on a node by density, radius, length and slip squared
IMPULSE = 2.0  # of the displaced mass: added mass, and the displaced liquid itself
TIP = 0.2  # cells from the tip to the end of the line
KERNEL = 0.85  # of the stick's radius, the kernel's unit
HELD_RADIUS = 1.05  # of the kernel's unit: the cylinder that a line held by it is, in viscous flow
PIVOT_DAMPING = 2e-5  # N m s
LARGEST_RATIO = 1.25  # of the nodes' moment of inertia to the stick's, that needs no correction
LEAST_SEEN = 0.1  # full cells that a node reckons with, at least

NODES_ABOVE = 4  # the surface at rest, for waves and for a stick that is lifted


class StickNodes(NamedTuple):
    """The nodes of a stick.

    Attributes:
        nodes: Number of them, one a cell.
        stretch: Unit of the kernel across the axis, in cells.
        half_width: Cells that the kernel reaches to either side.
        node_volume: What a node moves, in full cells.
    """

    nodes: int
    stretch: float
    half_width: int
    node_volume: float


def line_of(radius: float, cell: float, depth: float) -> StickNodes:
    """The line of a stick of `radius` in liquid of `depth`, on cells of `cell` [m]."""
    stretch = max(1.0, radius / (KERNEL * cell))
    nodes = math.ceil(depth / cell) + NODES_ABOVE
    return StickNodes(nodes, stretch, math.ceil(2.0 * stretch - 1e-9), node_volume(stretch))


def peskin(r: np.ndarray) -> np.ndarray:
    """Peskin's kernel of four points (2002, "The immersed boundary method", section 6)."""
    r = np.abs(r)
    inner = (3.0 - 2.0 * r + np.sqrt(np.maximum(0.0, 1.0 + 4.0 * r - 4.0 * r**2))) / 8.0
    outer = (5.0 - 2.0 * r - np.sqrt(np.maximum(0.0, -7.0 + 12.0 * r - 4.0 * r**2))) / 8.0
    return np.where(r < 1.0, inner, np.where(r < 2.0, outer, 0.0))


@cache
def node_volume(stretch: float) -> float:
    """Volume of a node [full cells].

    It is one over the mean squared sum of the plane's kernels, so that a push of all nodes alike is
    answered one to one.
    """
    offsets = (np.arange(400) + 0.5) / 400
    reach = math.ceil(2.0 * stretch) + 2
    weights = peskin((np.arange(-reach, reach + 1) - offsets[:, None]) / stretch)
    weights /= weights.sum(axis=1, keepdims=True)
    return float(1.0 / (weights**2).sum(axis=1).mean() ** 2)
