"""The stick's line in a picture: the best of many rays, both edges in each row, a robust fit."""

from typing import NamedTuple

import numpy as np

ROW_STEP = 6
SEARCH_ANGLES = np.radians(np.arange(-56.0, 56.1, 0.5))
MIN_ANGLE_APART = np.radians(8.0)  # nearer rays overlap the same stick
FLANK_SHARE = 0.6  # width of the strips compared with the stick, over the stick's width
STRIP_MARGIN = 9.0  # px on each side of the stick, across it
SMOOTHED_ROWS = 9  # levels inside and beside the stick change slowly along it
EDGE_BLUR = 1.5  # px on each side of an edge, across it, that its blur reaches
SATURATED = 254
HUBER_SDS = 1.5  # standard deviations up to which a row counts in full
OUTLIER_SDS = 4.0
MAX_ROUNDS = 12
LEAST_SPREAD = 1e-6  # normalised; below any camera's resolution
LONGEST_CORRELATION = 24  # rows


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
    """Excess of a bar of `width` about each pixel over the strips on both sides, >= 0."""
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


class Edges(NamedTuple):
    """The stick in each row; all of shape (rows,).

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


class Line(NamedTuple):
    """x = offset + slope * y in undistorted normalised coordinates.

    Attributes:
        slope: dx / dy, the tangent of the angle from the downward vertical.
        offset: x at y = 0, the height of the lens' axis.
        slope_error, offset_error: Standard errors.
        inlier: Which rows lie on the line, shape (rows,).
    """

    slope: float
    offset: float
    slope_error: float
    offset_error: float
    inlier: np.ndarray


NO_LINE = Line(*4 * (float("nan"),), inlier=np.zeros(0, bool))


def fit_line(points: np.ndarray) -> Line:
    """Straight line x(y) by Huber's M-estimate, started at the median of many pairs' slopes.

    The standard error takes the residuals' correlation from row to row into account.

    Args:
        points: x and y, undistorted normalised coordinates, shape (N, 2), finite, in the order
            of their rows.

    Returns:
        The line; `NO_LINE` when there are fewer than 8 points.
    """
    if len(points) < 8:
        return NO_LINE
    x, y = points[:, 0], points[:, 1]
    middle = y.mean()
    y = y - middle
    slope, offset = _pairs_start(x, y)
    spread = 0.0
    for _ in range(MAX_ROUNDS):
        residual = x - offset - slope * y
        spread = max(1.4826 * float(np.median(np.abs(residual))), LEAST_SPREAD)
        weight = np.minimum(1.0, HUBER_SDS * spread / np.maximum(np.abs(residual), 1e-12))
        weight[np.abs(residual) > OUTLIER_SDS * spread] = 0.0
        update = _weighted(x, y, weight)
        moved = abs(update[0] - slope) + abs(update[1] - offset)
        slope, offset = update
        if moved < 1e-9:
            break
    residual = x - offset - slope * y
    inlier = np.abs(residual) <= OUTLIER_SDS * spread
    variance = _variance(residual[inlier])
    y_in = y[inlier]
    slope_variance = variance / max(float(np.sum((y_in - y_in.mean()) ** 2)), 1e-12)
    lever = middle + float(y_in.mean())
    return Line(
        slope=slope,
        offset=offset - slope * middle,
        slope_error=float(np.sqrt(slope_variance)),
        offset_error=float(np.sqrt(variance / len(y_in) + lever**2 * slope_variance)),
        inlier=inlier,
    )


def _pairs_start(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Median slope of pairs half the length apart; holds with a quarter of the rows astray."""
    half = len(x) // 2
    slopes = (x[half:] - x[: len(x) - half]) / (y[half:] - y[: len(y) - half])
    slope = float(np.median(slopes))
    return slope, float(np.median(x - slope * y))


def _weighted(x: np.ndarray, y: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    total = weight.sum()
    mean_x, mean_y = weight @ x / total, weight @ y / total
    apart = y - mean_y
    slope = (weight * apart) @ (x - mean_x) / max(float(weight @ apart**2), 1e-12)
    return float(slope), float(mean_x - slope * mean_y)


def _variance(residual: np.ndarray) -> float:
    """Variance of a row, times what correlation between neighbouring rows adds to a mean's."""
    count = len(residual)
    variance = float(residual @ residual) / max(count - 2, 1)
    lags = min(LONGEST_CORRELATION, count // 4)
    if variance <= 0.0 or lags < 1:
        return max(variance, LEAST_SPREAD**2)
    correlation = np.array(
        [residual[lag:] @ residual[:-lag] / (residual @ residual) for lag in range(1, lags + 1)]
    )
    taper = np.minimum(1.0, 2.0 - 2.0 * np.arange(1, lags + 1) / (lags + 1))
    return max(variance, LEAST_SPREAD**2) * float(max(1.0 + 2.0 * taper @ correlation, 1.0))


def moment_slope(row: np.ndarray, centroid: np.ndarray, mass: np.ndarray) -> float:
    """Slope [columns per row] from the area's moments: its covariance over its variance.

    It uses the whole area where `fit_line` uses edges, and is not robust: where something hides
    part of the stick the two disagree.
    """
    total = float(mass.sum())
    if total <= 0.0:
        return float("nan")
    row_mean, column_mean = mass @ row / total, mass @ centroid / total
    apart = row - row_mean
    return float((mass * apart) @ (centroid - column_mean) / max(float(mass @ apart**2), 1e-9))
