"""Liquids at rest, and drops that oscillate."""

import numpy as np
from numpy.typing import ArrayLike

GRAVITY = 9.81


def hydrostatic_pressure(depth: ArrayLike, density: float, gravity: float = GRAVITY) -> np.ndarray:
    """Pressure [Pa] at `depth` [m] below a free surface; none above it."""
    return density * gravity * np.maximum(np.asarray(depth, float), 0.0)


def rayleigh_frequency(radius: float, *, tension: float, density: float, mode: int = 2) -> float:
    """Frequency [Hz] of small shape oscillations of a free drop without viscosity.

    Rayleigh 1879 (Proc. R. Soc. 29, 71): ω² = n (n-1) (n+2) σ / (ρ R³).

    Args:
        tension: Surface tension σ [N/m].
        mode: n, 2 for oblate to prolate.
    """
    squared = mode * (mode - 1) * (mode + 2) * tension / (density * radius**3)
    return float(np.sqrt(squared) / (2.0 * np.pi))


def column_frequency(radius: float, *, tension: float, density: float, mode: int = 2) -> float:
    """Frequency [Hz] of small oscillations across a round column of liquid, alike along it.

    Rayleigh 1879 (Proc. R. Soc. 29, 71): ω² = n (n² - 1) σ / (ρ R³).

    Args:
        tension: Surface tension σ [N/m].
        mode: n, 2 for an ellipse.
    """
    squared = mode * (mode**2 - 1) * tension / (density * radius**3)
    return float(np.sqrt(squared) / (2.0 * np.pi))


def rayleigh_decay(radius: float, *, viscosity: float, density: float, mode: int = 2) -> float:
    """Rate [1/s] at which `rayleigh_frequency` dies away in a liquid of low viscosity.

    Lamb, Hydrodynamics, section 355: (n-1) (2n+1) ν / R².
    """
    return (mode - 1) * (2 * mode + 1) * viscosity / (density * radius**2)


def laplace_pressure(radius: ArrayLike, tension: float) -> np.ndarray:
    """Pressure [Pa] inside a spherical drop above that outside: 2 σ / R."""
    return 2.0 * tension / np.asarray(radius, float)
