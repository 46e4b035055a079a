"""First guess of the stick's line: the best of many rays from the pivot."""

from typing import NamedTuple

import numpy as np

ROW_STEP = 6
SEARCH_ANGLES = np.radians(np.arange(-56.0, 56.1, 0.5))
MIN_ANGLE_APART = np.radians(8.0)  # nearer rays overlap the same stick
FLANK_SHARE = 0.6  # width of the strips compared with the stick, over the stick's width


class Ray(NamedTuple):
    """A line in the picture.

    Attributes:
        column: Where it starts [px].
        row: Where it starts [px].
        slope: Columns per row.
        response: Mean difference between the stick and what is beside it [grey levels].
        rival: The same of the best ray that is well apart from this one.
    """

    column: float
    row: float
    slope: float
    response: float
    rival: float


class Rows(NamedTuple):
    """Rows of the picture between which the stick is looked for, first to before last."""

    first: int
    last: int


def sampled_rows(image: np.ndarray, sign: float, rows: Rows) -> np.ndarray:
    """The rows that `search_rays` looks at, the stick brighter than the rest, float32."""
    return np.float32(sign) * image[rows.first : rows.last : ROW_STEP]


def search_rays(
    lines: np.ndarray,
    columns: np.ndarray,
    pivot_row: float,
    rows: Rows,
    *,
    width: float,
    length: float,
) -> Ray:
    """Try rays from every given start at every angle.

    Args:
        lines: What `sampled_rows` took from the picture.
        columns: Starts to try [px].
        pivot_row: Row of the starts [px].
        rows: Where to look.
        width: Of the stick [px].
        length: Of the stick [px]; a ray ends there.

    Returns:
        The ray along which the stick stands out most.
    """
    seen = np.arange(rows.first, rows.last, ROW_STEP)
    response = _stick_response(lines, width)
    below = seen - pivot_row
    slopes = np.tan(SEARCH_ANGLES)
    places = columns[:, None, None] + below[None, None, :] * slopes[None, :, None]
    index = np.rint(places).astype(np.intp)
    reached = below[None, :] <= length * np.cos(SEARCH_ANGLES)[:, None]
    valid = (index >= 0) & (index < lines.shape[1]) & reached[None]
    sampled = response[np.arange(len(seen)), np.clip(index, 0, lines.shape[1] - 1)]
    score = np.sum(sampled * valid, axis=2) / np.maximum(reached.sum(axis=1), 4)[None]
    start, angle = np.unravel_index(int(np.argmax(score)), score.shape)
    apart = np.abs(SEARCH_ANGLES - SEARCH_ANGLES[angle]) > MIN_ANGLE_APART
    return Ray(
        column=float(columns[start]),
        row=pivot_row,
        slope=float(slopes[angle]),
        response=float(score[start, angle]),
        rival=float(score[:, apart].max()),
    )


def _stick_response(lines: np.ndarray, width: float) -> np.ndarray:
    """How much a bar of `width` about each pixel exceeds the strips on both sides, >= 0."""
    inner = max(int(0.8 * width), 3) | 1
    flank = max(int(FLANK_SHARE * width), 2)
    total = np.cumsum(np.pad(lines, ((0, 0), (1, 0))), axis=1, dtype=np.float32)
    half, gap = inner // 2, int(np.ceil(0.75 * width))
    reach = gap + flank

    def mean(low: int, high: int) -> np.ndarray:
        middle = slice(reach + low, total.shape[1] - reach + low - 1)
        end = slice(reach + high, total.shape[1] - reach + high - 1)
        return (total[:, end] - total[:, middle]) / (high - low)

    beside = np.maximum(mean(-reach, -gap), mean(gap + 1, reach + 1))
    response = np.zeros(lines.shape, np.float32)
    response[:, reach:-reach] = np.maximum(mean(-half, half + 1) - beside, 0.0)
    return response
