"""Flows of a liquid in an upright cylindrical cup: around its axis, and to and fro."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j1, jn_zeros, jnp_zeros

from .surfaces import GRAVITY

POINTS = 4001  # of the quadrature over the radius


def swirl_mode(r: ArrayLike, radius: float) -> np.ndarray:
    """The flow around the axis that decays last, J1(j r/R), 1 where it is fastest."""
    slowest = jn_zeros(1, 1)[0]
    return j1(slowest * np.asarray(r, float) / radius) / j1(jnp_zeros(1, 1)[0])


def swirl_decay(radius: float, kinematic: ArrayLike) -> np.ndarray:
    """Rate of decay of `swirl_mode` [1/s] in a cup whose floor does not rub: ν (j/R)², J1(j) = 0.

    Batchelor 1967, section 4.5: the slowest part of the flow that a long cylinder has after it
    stopped.

    Args:
        radius: R [m].
        kinematic: ν [m²/s].
    """
    return np.asarray(kinematic, float) * (jn_zeros(1, 1)[0] / radius) ** 2


def implicit_rate(rate: ArrayLike, dt: float) -> np.ndarray:
    """Decay [1/s] that implicit Euler steps `dt` [s] make of a `rate`: log(1 + rate dt) / dt."""
    return np.log1p(np.asarray(rate, float) * dt) / dt


def driven_swirl(
    r: ArrayLike, acceleration: Callable[[np.ndarray], np.ndarray], radius: float, kinematic: float
) -> np.ndarray:
    """Steady speed around the axis [m/s] of liquid that is accelerated around it.

    From ν ((r u)' / r)' = -a with u = 0 at the wall R: r u = C r²/2 - ∫ r G dr / ν, where
    G = ∫ a dr and C makes u(R) = 0. For a = A r that is A (R² r - r³) / 8 ν; a thin ring turns
    what is within it rigidly, and drags the rest as between cylinders (Batchelor 1967, section
    4.5).

    Args:
        r: Distances from the axis [m], shape [n].
        acceleration: a [m/s²] at distances [m].
        radius: R [m].
        kinematic: ν [m²/s].
    """
    at = np.linspace(0.0, radius, POINTS)
    moment = _integral(at, at * _integral(at, acceleration(at)))
    speed = (moment[-1] * (at / radius) ** 2 - moment) / np.maximum(at, at[1]) / kinematic
    return np.interp(np.asarray(r, float), at, speed)


def sloshing_period(radius: float, depth: float, gravity: float = GRAVITY) -> float:
    """Period of the lowest wave from side to side [s]: ω² = g k tanh(k h), k = 1.8412 / R.

    Lamb, Hydrodynamics, section 191; a small wave on liquid without viscosity.
    """
    k = jnp_zeros(1, 1)[0] / radius
    return float(2.0 * np.pi / np.sqrt(gravity * k * np.tanh(k * depth)))


def sloshing_velocity(points: np.ndarray, radius: float, depth: float) -> np.ndarray:
    """Velocities of that wave while the surface is flat, shape (n, 3), largest 1 at the surface.

    The gradient of J1(k r) cos θ cosh(k z), θ from the x axis.
    """
    k = jnp_zeros(1, 1)[0] / radius
    x, y, z = points.T
    r = np.maximum(np.hypot(x, y), 1e-9)
    around = j1(k * r) / r  # the potential's share of x, before cosh
    slope = (k * _j1_slope(k * r) - around) / r**2
    along = np.stack([(around + slope * x**2), slope * x * y], axis=1) * np.cosh(k * z)[:, None]
    up = k * around * x * np.sinh(k * z)
    return np.column_stack([along, up]) / (0.5 * k * np.cosh(k * depth))


def _j1_slope(x: np.ndarray) -> np.ndarray:
    step = 1e-5
    return (j1(x + step) - j1(x - step)) / (2.0 * step)


def _integral(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """From the first of equally spaced points to each."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]))]) * x[1]
