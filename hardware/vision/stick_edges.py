"""Left and right edge of the stick in every row, to a fraction of a pixel."""

from typing import NamedTuple

import numpy as np

from .coarse_search import Ray, Rows

STRIP_MARGIN = 9.0  # px on each side of the stick, across it
SMOOTHED_ROWS = 9  # levels inside and beside the stick change slowly along it
EDGE_BLUR = 1.5  # px on each side of an edge, across it, that its blur reaches
SATURATED = 254


class Edges(NamedTuple):
    """What was found in each row; all of shape (rows,).

    Attributes:
        row: [px].
        left, right: Columns of the edges [px]; NaN where there is none.
        contrast: Between the stick and what is beside it [grey levels].
        mass: Area of the stick in the row [px].
        centroid: Its mean column [px].
        saturated: Share of the pixels near the stick that are saturated, of all rows together.
    """

    row: np.ndarray
    left: np.ndarray
    right: np.ndarray
    contrast: np.ndarray
    mass: np.ndarray
    centroid: np.ndarray
    saturated: float


def find_edges(image: np.ndarray, sign: float, ray: Ray, rows: Rows, width: float) -> Edges:
    """Look for both edges near a first guess of the line.

    Grey levels are turned into the share of the stick in a pixel, 1 at the level inside the stick
    and 0 at the level beside it. The left and the right have levels of their own: the background
    may differ.

    Args:
        image: Grey levels, uint8.
        sign: -1 for a dark stick, 1 for a bright one.
        ray: The first guess.
        rows: Where to look.
        width: Of the stick across its axis [px].
    """
    row = np.arange(rows.first, rows.last)
    stretch = float(np.hypot(1.0, ray.slope))
    half, reach = 0.5 * width * stretch, int(np.ceil((0.5 * width + STRIP_MARGIN) * stretch))
    centre = np.rint(ray.column + ray.slope * (row - ray.row)).astype(np.intp)
    offsets = np.arange(-reach, reach + 1)
    columns = centre[:, None] + offsets
    part = image[row[:, None], np.clip(columns, 0, image.shape[1] - 1)]
    strength = np.float32(sign) * part.astype(np.float32)
    inside = _level(strength[:, np.abs(offsets) <= max(0.4 * half, 1.0)])
    beside = (
        _level(strength[:, offsets < -half - 3.0 * stretch]),
        _level(strength[:, offsets > half + 3.0 * stretch]),
    )
    behind = np.where(offsets[None, :] < 0, beside[0][:, None], beside[1][:, None])
    share = (strength - behind) / np.maximum(inside[:, None] - behind, 1.0)
    blur = int(np.ceil(EDGE_BLUR * stretch))
    left = -_outward_edge(share[:, reach::-1], blur)
    right = _outward_edge(share[:, reach:], blur)
    mass, moment = _soft_mass(share, offsets)
    outside = (centre < reach) | (centre >= image.shape[1] - reach)
    left[outside] = np.nan
    return Edges(
        row=row,
        left=centre + left,
        right=centre + right,
        contrast=inside - np.maximum(*beside),
        mass=mass,
        centroid=centre + moment / np.maximum(mass, 1e-3),
        saturated=float(np.mean(part >= SATURATED)),
    )


def _level(strength: np.ndarray) -> np.ndarray:
    """Median level of each row, smoothed along the rows."""
    # a median: lines in the background, such as the cup's, are narrow
    middle = strength.shape[1] // 2
    level = np.partition(strength, middle, axis=1)[:, middle]
    if len(level) < SMOOTHED_ROWS:
        return np.full_like(level, level.mean()) if len(level) else level
    half = SMOOTHED_ROWS // 2
    padded = np.cumsum(np.pad(level, (half + 1, half), mode="edge"), dtype=np.float64)
    padded -= padded[0]
    smooth = (padded[SMOOTHED_ROWS:] - padded[:-SMOOTHED_ROWS]) / SMOOTHED_ROWS
    return smooth.astype(np.float32)


def _outward_edge(share: np.ndarray, blur: int) -> np.ndarray:
    """Steps from the first column to the edge in each row; NaN where there is none.

    The first column whose share is below a half tells where the edge is, and the area of the
    shares around it where exactly: unlike a crossing between two pixels, an area has no error
    that depends on where in a pixel the edge falls, and that a nearly upright stick would turn
    into a wrong slope.
    """
    below = share < 0.5
    first = np.argmax(below, axis=1)
    area = np.cumsum(np.pad(share, ((0, 0), (1, 0))), axis=1, dtype=np.float32)
    start = np.maximum(first - 1 - blur, 0)
    end = np.minimum(first + 1 + blur, share.shape[1])
    rows = np.arange(len(share))
    edge = start - 0.5 + area[rows, end] - area[rows, start]
    edge[~below.any(axis=1) | (first == 0)] = np.nan
    return edge


def _soft_mass(share: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Area and first moment of the stick in each row, pixels weighted by how full they are."""
    share = np.clip(share, 0.0, 1.0)
    share[share < 0.35] = 0.0
    return share.sum(axis=1), share @ offsets.astype(np.float32)
