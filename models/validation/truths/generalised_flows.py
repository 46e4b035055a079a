"""Plane Poiseuille flow of liquids whose viscosity depends on the shear rate.

Channels reach from z = 0 to z = gap, with walls at rest, driven by a force per volume
`gradient` G [Pa/m]; the shear stress is G times the distance from the middle, whatever the
liquid.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import cumulative_simpson
from scipy.optimize import root_scalar

NODES = 2001  # across half a channel, for the profiles that are integrated


def herschel_bulkley_channel(
    z: ArrayLike,
    *,
    gap: float,
    gradient: float,
    consistency: float,
    index: float = 1.0,
    yield_stress: float = 0.0,
) -> np.ndarray:
    """Velocity [m/s] of a liquid of stress τ_y + K γ̇^n; a plug where the stress is below τ_y.

    Bird, Dai & Yarusso 1983 (Rev. Chem. Eng. 1, 1) and, for τ_y = 0 and n = 1, the parabola.

    Args:
        consistency: K [Pa s^n].
        index: n.
        yield_stress: τ_y [Pa].
    """
    half, plug = 0.5 * gap, yield_stress / gradient
    z = np.asarray(z, float)
    if plug >= half:
        return np.zeros_like(z)
    power = 1.0 + 1.0 / index
    scale = (gradient / consistency) ** (1.0 / index) / power
    beyond = np.maximum(np.abs(z - half) - plug, 0.0)
    return scale * ((half - plug) ** power - beyond**power)


def herschel_bulkley_flow_rate(
    *,
    gap: float,
    gradient: float,
    consistency: float,
    index: float = 1.0,
    yield_stress: float = 0.0,
) -> float:
    """Flow rate per width [m²/s] of `herschel_bulkley_channel`."""
    half, plug = 0.5 * gap, yield_stress / gradient
    if plug >= half:
        return 0.0
    sheared = half - plug
    power = 1.0 + 1.0 / index
    scale = (gradient / consistency) ** (1.0 / index) / power
    return 2.0 * scale * sheared**power * (half - sheared * index / (2.0 * index + 1.0))


def power_law_viscosity(rate: ArrayLike, *, consistency: float, index: float) -> np.ndarray:
    """Viscosity [Pa s] K γ̇^(n-1) (Ostwald & de Waele)."""
    return consistency * np.asarray(rate, float) ** (index - 1.0)


def carreau_viscosity(
    rate: ArrayLike, *, zero: float, infinite: float, time: float, index: float
) -> np.ndarray:
    """Viscosity [Pa s] of Carreau 1972 (Trans. Soc. Rheol. 16, 99).

    Args:
        rate: Shear rate [1/s].
        zero, infinite: Viscosities at rest and at large rates [Pa s].
        time: λ [s]; thinning sets in at 1/λ.
        index: n of the power law in between.
    """
    thinned = (1.0 + (time * np.asarray(rate, float)) ** 2) ** (0.5 * (index - 1.0))
    return infinite + (zero - infinite) * thinned


def generalised_channel(
    z: ArrayLike, *, gap: float, gradient: float, viscosity: Callable[[float], float]
) -> np.ndarray:
    """Velocity [m/s] of any liquid whose stress grows with the shear rate.

    At each distance from the middle the rate γ̇ solves viscosity(γ̇) γ̇ = stress; the velocity
    is its integral from the wall.

    Args:
        viscosity: Function of the shear rate [1/s], in Pa s.

    Raises:
        ValueError: no shear rate below 1e9 /s carries the stress at the wall.
    """
    half = 0.5 * gap
    distance = np.linspace(0.0, half, NODES)
    rates = np.array([_shear_rate(gradient * y, viscosity) for y in distance])
    from_middle = cumulative_simpson(rates, x=distance, initial=0.0)
    return np.interp(np.abs(np.asarray(z, float) - half), distance, from_middle[-1] - from_middle)


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
