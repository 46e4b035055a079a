"""Velocity profiles of particles, and the viscosity that they flow with.

Channels reach from z = 0 to z = gap.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar


class Profile(NamedTuple):
    """Means of particles in bins, all [n]; bins without particles are left out.

    Attributes:
        at: Mean coordinate of the particles in the bin.
        mean: Their mean value.
        particles: How many there were.
    """

    at: np.ndarray
    mean: np.ndarray
    particles: np.ndarray


class PoiseuilleFit(NamedTuple):
    """A parabola through a steady profile.

    Attributes:
        viscosity: Dynamic, from the curvature alone, which slip at the walls leaves as it is
            [Pa s]; infinite where the profile does not bend the way that it is driven.
        slip: Velocity of the parabola at the lower and at the upper wall [m/s].
        rms: Of the residuals [m/s].
    """

    viscosity: float
    slip: tuple[float, float]
    rms: float


class CouetteFit(NamedTuple):
    """A straight line through a steady profile.

    Attributes:
        shear_rate: Its slope [1/s].
        slip: Velocity of the liquid at the wall less that of the wall, lower and upper [m/s].
        rms: Of the residuals [m/s].
    """

    shear_rate: float
    slip: tuple[float, float]
    rms: float


class ViscosityFit(NamedTuple):
    """The kinematic viscosity [m²/s] whose flow comes closest, and the RMS left [m/s]."""

    kinematic: float
    rms: float


def binned_profile(at: ArrayLike, values: ArrayLike, low: float, high: float, bins: int) -> Profile:
    """Mean of particles' `values` over equal bins of their coordinate `at`; any equal shapes.

    Raises:
        ValueError: no particle lies from `low` to `high`.
    """
    at, values = np.ravel(at).astype(float), np.ravel(values).astype(float)
    inside = (at >= low) & (at < high)
    if not inside.any():
        raise ValueError(f"no particle lies between {low:g} and {high:g} m")
    bin_of = ((at[inside] - low) / (high - low) * bins).astype(int)
    count = np.bincount(bin_of, minlength=bins)
    held = count > 0
    where, mean = (np.bincount(bin_of, v[inside], bins)[held] / count[held] for v in (at, values))
    return Profile(where, mean, count[held])


def fit_poiseuille(z: ArrayLike, velocity: ArrayLike, gap: float, gradient: float) -> PoiseuilleFit:
    """Effective viscosity of a steady channel flow by least squares over particles or bins.

    Args:
        z: Heights [m], shape [n].
        velocity: Along the channel [m/s], shape [n].
        gradient: Force per volume that drives it [Pa/m].
    """
    z, velocity = np.asarray(z, float), np.asarray(velocity, float)
    # in units of the gap: a polynomial in metres is ill-conditioned
    bend, slope, low = (float(c) for c in np.polyfit(z / gap, velocity, 2))
    residual = velocity - np.polyval((bend, slope, low), z / gap)
    viscosity = -gradient * gap**2 / (2.0 * bend) if bend * gradient < 0.0 else np.inf
    return PoiseuilleFit(viscosity, (low, bend + slope + low), _rms(residual))


def fit_couette(z: ArrayLike, velocity: ArrayLike, gap: float, speed: float) -> CouetteFit:
    """Shear rate and slip of a steady flow between a wall at rest and one that moves at `speed`.

    Args:
        z: Heights [m], shape [n].
        velocity: Along the walls [m/s], shape [n].
    """
    z, velocity = np.asarray(z, float), np.asarray(velocity, float)
    slope, low = (float(c) for c in np.polyfit(z / gap, velocity, 1))
    residual = velocity - np.polyval((slope, low), z / gap)
    return CouetteFit(slope / gap, (low, slope + low - speed), _rms(residual))


def fit_kinematic_viscosity(
    flow: Callable[[float], np.ndarray], velocity: ArrayLike, low: float, high: float
) -> ViscosityFit:
    """The viscosity whose analytic flow fits measured velocities best, by least squares.

    Args:
        flow: Velocities [m/s] of a truth, such as `truths.shear_flows.couette_startup`, as a
            function of the kinematic viscosity [m²/s]; the shape of `velocity`.
        velocity: Measured; not finite entries are left out.
        low, high: Limits of the search.

    Raises:
        ValueError: no velocity is finite, or the limits do not ascend.
    """
    velocity = np.asarray(velocity, float)
    finite = np.isfinite(velocity)
    if not finite.any() or not 0.0 < low < high:
        raise ValueError(f"a fit needs finite velocities and 0 < low < high, got {low}, {high}")

    def rms(log_viscosity: float) -> float:
        return _rms((flow(float(np.exp(log_viscosity))) - velocity)[finite])

    # a scan first: of late times alone every large viscosity fits alike
    grid = np.linspace(np.log(low), np.log(high), 41)
    at = int(np.argmin([rms(value) for value in grid]))
    around = grid[max(at - 1, 0)], grid[min(at + 1, len(grid) - 1)]
    best: Any = minimize_scalar(rms, bounds=around, method="bounded", options={"xatol": 1e-6})
    return ViscosityFit(float(np.exp(best.x)), rms(float(best.x)))


def wave_amplitude(at: ArrayLike, velocity: ArrayLike, wave_number: float) -> np.ndarray:
    """Amplitude [m/s] of a wave in particles' velocities, whatever its phase.

    Least squares of a constant, cos(k x) and sin(k x), so that an uneven spread of particles
    does not matter.

    Args:
        at: Coordinate along which the wave varies [m], shape [..., n].
        velocity: Component that waves [m/s], shape [..., n].
        wave_number: k [1/m].

    Returns:
        Shape [...].
    """
    at, velocity = np.asarray(at, float), np.asarray(velocity, float)
    phase = wave_number * at
    basis = np.stack([np.ones_like(phase), np.cos(phase), np.sin(phase)], axis=-1)
    coefficients = np.linalg.pinv(basis) @ velocity[..., None]
    return np.hypot(coefficients[..., 1, 0], coefficients[..., 2, 0])


def decay_rate(time: ArrayLike, amplitude: ArrayLike) -> float:
    """Rate [1/s] of an exponential decay, by least squares of the logarithm.

    Raises:
        ValueError: fewer than two amplitudes, or one is not positive.
    """
    time, amplitude = np.asarray(time, float), np.asarray(amplitude, float)
    if len(time) < 2 or not (amplitude > 0.0).all():
        raise ValueError("a decay needs two or more positive amplitudes; end before the noise")
    return -float(np.polyfit(time, np.log(amplitude), 1)[0])


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
