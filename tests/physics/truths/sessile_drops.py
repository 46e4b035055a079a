"""Drops at rest on a floor that they meet at a contact angle."""

from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid

STRIPS = 2001  # of a cross-section


class Ridge(NamedTuple):
    """Of a long drop: half of it is below `height`, and half within `width` to either side [m]."""

    height: float
    width: float


def cylindrical_cap(area: float, angle: float) -> Ridge:
    """A long drop without weight, whose cross-section is a segment of a circle.

    The segment's area is R² (a - sin a cos a).

    Args:
        area: Of the cross-section [m²].
        angle: Contact angle a [rad], above 0.
    """
    radius = np.sqrt(area / (angle - np.sin(angle) * np.cos(angle)))
    middle = -radius * np.cos(angle)  # height of the circle's
    up = np.linspace(0.0, middle + radius, STRIPS)
    across = np.linspace(0.0, radius * np.sin(min(angle, 0.5 * np.pi)), STRIPS)
    half_chord = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    over_floor = middle + half_chord - np.maximum(middle - half_chord, 0.0)
    width_there = np.sqrt(np.maximum(radius**2 - (up - middle) ** 2, 0.0))
    return Ridge(_median(up, width_there), _median(across, over_floor))


def _median(at: np.ndarray, density: np.ndarray) -> float:
    so_far = cumulative_trapezoid(density, at, initial=0.0)
    return float(np.interp(0.5 * so_far[-1], so_far, at))
