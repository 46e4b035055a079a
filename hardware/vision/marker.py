"""The round bright marker on the dark gripper: where it is, to a fraction of a pixel."""

from typing import NamedTuple

import numpy as np

from .camera_model import opencv

SEARCH_REDUCTION = 4  # the first search runs on a picture this much smaller
CANDIDATES = 3
LEAST_CONTRAST = 30.0
AREA_RATIO = (0.6, 1.6)  # found over expected
MIN_ROUNDNESS = 0.75  # smaller over larger principal extent


class Marker(NamedTuple):
    """Centre of the marker.

    Attributes:
        column, row: Of the centre [px].
    """

    column: float
    row: float


def find_marker(image: np.ndarray, radius: float) -> Marker | None:
    """Find a bright disc with a dark surround.

    Args:
        image: Grey levels, uint8.
        radius: Expected in the picture [px].

    Returns:
        The disc that stands out most among those of the right size and roundness, or None.
    """
    for column, row in _candidates(image, radius):
        found = _centroid(image, column, row, radius)
        if found is not None:
            return found
    return None


def _candidates(image: np.ndarray, radius: float) -> list[tuple[float, float]]:
    """Places [px] that are brighter than all their surround, best first."""
    cv2 = opencv()
    small = cv2.resize(
        image, None, fx=1 / SEARCH_REDUCTION, fy=1 / SEARCH_REDUCTION, interpolation=3
    )
    inner = max(int(round(1.2 * radius / SEARCH_REDUCTION)) | 1, 1)
    centre = cv2.blur(small, (inner, inner))
    step = int(np.ceil(1.6 * radius / SEARCH_REDUCTION))
    # the brightest of the surround counts: an edge of the background is no marker
    around = cv2.dilate(small, _ring(step))
    response = cv2.subtract(centre, around)
    places = []
    for _ in range(CANDIDATES):
        _, best, _, (x, y) = cv2.minMaxLoc(response)
        if best < LEAST_CONTRAST:
            break
        places.append(((x + 0.5) * SEARCH_REDUCTION - 0.5, (y + 0.5) * SEARCH_REDUCTION - 0.5))
        response[max(y - step, 0) : y + step + 1, max(x - step, 0) : x + step + 1] = 0
    return places


def _ring(radius: int) -> np.ndarray:
    """Structuring element: the points at about `radius` from the middle."""
    offsets = np.arange(-radius, radius + 1)
    distance = np.hypot(offsets[:, None], offsets[None, :])
    return (np.abs(distance - radius) < 0.6).astype(np.uint8)


def _centroid(image: np.ndarray, column: float, row: float, radius: float) -> Marker | None:
    """Refine a place; None if what is there is not round or not of the expected size."""
    reach = int(np.ceil(1.7 * radius)) + 2
    left, top = int(round(column)) - reach, int(round(row)) - reach
    size = 2 * reach + 1
    if left < 0 or top < 0 or left + size > image.shape[1] or top + size > image.shape[0]:
        return None
    part = image[top : top + size, left : left + size].astype(np.float32)
    offsets = np.arange(-reach, reach + 1, dtype=np.float32)
    square = offsets[:, None] ** 2 + offsets[None, :] ** 2
    bright = float(np.median(part[square < (0.5 * radius) ** 2]))
    dark = float(np.percentile(part[square < (1.7 * radius) ** 2], 10))
    if bright - dark < LEAST_CONTRAST:
        return None
    level = np.uint8(0.5 * (bright + dark))
    cv2 = opencv()
    _, labels = cv2.connectedComponents((part > level).astype(np.uint8))
    label = labels[reach, reach]
    if label == 0:
        return None
    # the blurred rim belongs to the disc in proportion to its brightness
    disc = cv2.dilate((labels == label).astype(np.uint8), np.ones((5, 5), np.uint8))
    weight = np.clip((part - dark) / (bright - dark), 0.0, 1.0) * disc
    weight[weight < 0.2] = 0.0
    return _round_disc(weight, offsets, radius, (left + reach, top + reach))


def _round_disc(
    weight: np.ndarray, offsets: np.ndarray, radius: float, origin: tuple[int, int]
) -> Marker | None:
    mass = float(weight.sum())
    if not AREA_RATIO[0] < mass / (np.pi * radius**2) < AREA_RATIO[1]:
        return None
    columns, rows = weight.sum(axis=0), weight.sum(axis=1)
    x, y = float(columns @ offsets) / mass, float(rows @ offsets) / mass
    xx = float(columns @ offsets**2) / mass - x * x
    yy = float(rows @ offsets**2) / mass - y * y
    xy = float(offsets @ weight @ offsets) / mass - x * y
    spread = np.hypot(0.5 * (xx - yy), xy)
    smaller, larger = 0.5 * (xx + yy) - spread, 0.5 * (xx + yy) + spread
    if smaller < MIN_ROUNDNESS**2 * larger:
        return None
    return Marker(origin[0] + x, origin[1] + y)
