"""Drops at rest on a floor that they meet at a contact angle."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import cumulative_trapezoid, solve_ivp
from scipy.optimize import root_scalar

STRIPS = 2001  # of a cross-section
LONGEST_ARC = 50.0  # capillary lengths along the surface, from the top; a drop is smaller


class Drop(NamedTuple):
    """A drop's height, and the radius of its foot on the floor [m]."""

    height: float
    foot: float


def spherical_cap(volume: float, angle: float) -> Drop:
    """A drop so small that it has no weight.

    V = π R³ (2 + cos a) (1 - cos a)² / 3.

    Args:
        volume: V [m³].
        angle: Contact angle a [rad].
    """
    share = np.pi * (2.0 + np.cos(angle)) * (1.0 - np.cos(angle)) ** 2 / 3.0
    radius = np.cbrt(volume / share)
    return Drop(float(radius * (1.0 - np.cos(angle))), float(radius * np.sin(angle)))


def puddle_height(angle: ArrayLike, length: float) -> np.ndarray:
    """Height [m] of a drop so large that it is flat: 2 sin(a/2) times `length`.

    De Gennes, Brochard-Wyart & Quéré 2004, Capillarity and Wetting Phenomena, section 2.2; exact
    for a strip without ends.

    Args:
        angle: Contact angle a [rad].
        length: Capillary length [m], see `menisci.capillary_length`.
    """
    return 2.0 * length * np.sin(0.5 * np.asarray(angle, float))


def sessile_drop(volume: float, angle: float, length: float) -> Drop:
    """A drop of any size, by the equations of Bashforth & Adams (1883).

    Along the surface from its top: dr/ds = cos φ, dz/ds = sin φ, dφ/ds = 2/b + z/l² - sin φ / r;
    the curvature 1/b of the top is the one that makes the volume.

    Args:
        volume: [m³].
        angle: Contact angle [rad], above 0.
        length: Capillary length l [m].

    Raises:
        ValueError: It is wider than 50 of these.
    """
    size = volume / length**3
    cap = spherical_cap(size, angle)

    def too_large(log_top: float) -> float:
        held = _drop(float(np.exp(log_top)), angle)
        return np.log(LONGEST_ARC**3) if held is None else float(np.log(held.volume / size))

    # weight flattens the top of a puddle without end; a cap's is the roundest
    low = np.log((cap.height**2 + cap.foot**2) / (2.0 * cap.height)) - 0.1
    high = low + 1.0
    while too_large(high) < 0.0:
        high += 1.0
    log_top = root_scalar(too_large, bracket=(low, high), xtol=1e-10).root
    found = _drop(float(np.exp(log_top)), angle)
    if found is None or not np.isclose(found.volume, size, rtol=1e-6):
        widest = LONGEST_ARC * length
        raise ValueError(f"a drop of {volume:g} m³ is wider than {widest:g} m; take a smaller one")
    return Drop(found.height * length, found.foot * length)


class _Held(NamedTuple):
    """In capillary lengths."""

    height: float
    foot: float
    volume: float


def _drop(top: float, angle: float) -> _Held | None:
    """The drop whose top has this radius of curvature; None for one without an end.

    A series begins the surface, where sin φ / r is 0 / 0.
    """
    start = 1e-4 * min(top, 1.0)

    def along(_, state):
        r, z, slope, _ = state
        curvature = 2.0 / top + z - np.sin(slope) / r
        return [np.cos(slope), np.sin(slope), curvature, np.pi * r**2 * np.sin(slope)]

    def at_floor(_, state):
        return state[2] - angle

    end: Any = at_floor
    end.terminal = True
    begun = [start, start**2 / (2.0 * top), start / top, np.pi * start**4 / (4.0 * top)]
    solved = solve_ivp(
        along, (start, LONGEST_ARC), begun, events=end, rtol=1e-10, atol=1e-14, method="DOP853"
    )
    if not solved.t_events[0].size:
        return None
    r, z, _, volume = solved.y_events[0][0]
    return _Held(float(z), float(r), float(volume))


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
