"""Liquids at rest, films that drain and drops that oscillate."""

import numpy as np
from numpy.typing import ArrayLike

GRAVITY = 9.81


def hydrostatic_pressure(depth: ArrayLike, density: float, gravity: float = GRAVITY) -> np.ndarray:
    """Pressure [Pa] at `depth` [m] below a free surface; none above it."""
    return density * gravity * np.maximum(np.asarray(depth, float), 0.0)


def jeffreys_thickness(
    below_edge: ArrayLike,
    time: ArrayLike,
    *,
    viscosity: ArrayLike,
    density: float,
    gravity: float = GRAVITY,
) -> np.ndarray:
    """Thickness [m] of a film that drains down a wall: sqrt(μ z / (ρ g t)).

    Jeffreys 1930 (Proc. Camb. Phil. Soc. 26, 204); long after the liquid left, without surface
    tension. A wall at angle α to the vertical has g cos α in place of g.

    Args:
        below_edge: Distance z below the film's upper edge [m].
        time: Since the wall was laid bare [s].
        viscosity: Scalar or array; all broadcast.
    """
    z, time = np.asarray(below_edge, float), np.asarray(time, float)
    return np.sqrt(np.asarray(viscosity, float) * z / (density * gravity * time))


def jeffreys_volume(
    width: float,
    height: float,
    time: ArrayLike,
    *,
    viscosity: ArrayLike,
    density: float,
    gravity: float = GRAVITY,
) -> np.ndarray:
    """Volume [m³] that the film of `jeffreys_thickness` still holds.

    Its mean thickness is two thirds of that at the bottom. On the inside of a cup the width is
    the wetted part of the circumference, if the film is thin against the radius.

    Args:
        width, height: Of the wall [m].
    """
    thickest = jeffreys_thickness(
        height, time, viscosity=viscosity, density=density, gravity=gravity
    )
    return width * height * thickest * 2.0 / 3.0


def rayleigh_frequency(radius: float, *, tension: float, density: float, mode: int = 2) -> float:
    """Frequency [Hz] of small shape oscillations of a free drop without viscosity.

    Rayleigh 1879 (Proc. R. Soc. 29, 71): ω² = n (n-1) (n+2) σ / (ρ R³).

    Args:
        tension: Surface tension σ [N/m].
        mode: n, 2 for oblate to prolate.
    """
    squared = mode * (mode - 1) * (mode + 2) * tension / (density * radius**3)
    return float(np.sqrt(squared) / (2.0 * np.pi))


def rayleigh_decay(radius: float, *, viscosity: float, density: float, mode: int = 2) -> float:
    """Rate [1/s] at which `rayleigh_frequency` dies away in a liquid of low viscosity.

    Lamb, Hydrodynamics, section 355: (n-1) (2n+1) ν / R².
    """
    return (mode - 1) * (2 * mode + 1) * viscosity / (density * radius**2)


def laplace_pressure(radius: ArrayLike, tension: float) -> np.ndarray:
    """Pressure [Pa] inside a spherical drop above that outside: 2 σ / R."""
    return 2.0 * tension / np.asarray(radius, float)
