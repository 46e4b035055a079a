"""Steady flow around a cup's axis of liquids whose viscosity depends on the shear rate.

An acceleration A r around the axis drives them. At a distance r from it the shear stress is then
drive r² / 4 whatever the liquid, where `drive` is density times A [Pa/m²].
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import cumulative_simpson
from scipy.optimize import root_scalar

NODES = 2001  # from the axis to the wall, for the profiles that are integrated


def generalised_swirl(
    r: ArrayLike, *, radius: float, drive: float, viscosity: Callable[[float], float]
) -> np.ndarray:
    """Speed around the axis [m/s] of any liquid whose stress grows with the shear rate.

    At each distance the rate solves viscosity(rate) rate = stress; the angular velocity is the
    integral of rate over distance, from the wall.

    Args:
        r: Distances from the axis [m].
        radius: Of the wall [m].
        viscosity: Function of the shear rate [1/s], in Pa s.

    Raises:
        ValueError: no shear rate below 1e9 /s carries the stress at the wall.
    """
    at = np.linspace(0.0, radius, NODES)
    rates = np.array([_shear_rate(0.25 * drive * d**2, viscosity) for d in at])
    turn = cumulative_simpson(rates[1:] / at[1:], x=at[1:], initial=0.0)
    turn = np.concatenate([turn[:1], turn])  # nothing is sheared at the axis
    return np.asarray(r, float) * np.interp(np.asarray(r, float), at, turn[-1] - turn)


def _shear_rate(stress: float, viscosity: Callable[[float], float]) -> float:
    if stress <= 0.0:
        return 0.0

    def excess(log_rate: float) -> float:
        rate = np.exp(log_rate)
        return np.log(float(viscosity(rate)) * rate / stress)

    low, high = np.log(1e-12), np.log(1e9)
    if excess(high) < 0.0:
        raise ValueError(f"no shear rate up to 1e9 /s has a stress of {stress:g} Pa")
    if excess(low) > 0.0:
        return 0.0
    return float(np.exp(root_scalar(excess, bracket=(low, high), xtol=1e-12).root))
