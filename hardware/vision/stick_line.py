"""Robust straight line through the middle of the stick, with its standard error."""

from typing import NamedTuple

import numpy as np

HUBER_SDS = 1.5  # standard deviations up to which a row counts in full
OUTLIER_SDS = 4.0
MAX_ROUNDS = 12
LEAST_SPREAD = 1e-6  # normalised; below any camera's resolution
LONGEST_CORRELATION = 24  # rows


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
