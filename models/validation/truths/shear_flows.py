"""Unidirectional flows of a Newtonian liquid: channels, a shear wave, a spun cylinder.

Channels reach from z = 0 to z = gap. `kinematic` is the kinematic viscosity [m²/s].
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import jn_zeros, jv

TERMS = 200  # of each series: to 1e-4 of the scale at 1e-4 diffusion times


def couette_steady(z: ArrayLike, gap: float, speed: float) -> np.ndarray:
    """Velocity [m/s] between a wall at rest at z = 0 and one that moves at `speed`."""
    return speed * np.asarray(z, float) / gap


def couette_startup(
    z: ArrayLike, time: ArrayLike, *, gap: float, speed: float, kinematic: float
) -> np.ndarray:
    """Velocity [m/s] after the wall at z = gap started to move at `speed` at time 0.

    Batchelor 1967, An Introduction to Fluid Dynamics, section 4.3; a test case of particle
    methods since Morris, Fox & Zhu 1997 (J. Comput. Phys. 136, section 4.1).

    Args:
        z: Heights [m], shape [n].
        time: Scalar or shape [t] [s].

    Returns:
        Shape [n], or [t, n] for several times.
    """
    order = np.arange(1, TERMS + 1)
    weight = 2.0 * speed * (-1.0) ** order / (order * np.pi)
    return couette_steady(z, gap, speed) + _sines(z, time, gap, kinematic, order, weight)


def poiseuille_steady(z: ArrayLike, *, gap: float, gradient: float, viscosity: float) -> np.ndarray:
    """Velocity [m/s] between walls at rest, driven by a force per volume `gradient` [Pa/m].

    Args:
        viscosity: Dynamic viscosity [Pa s].
    """
    z = np.asarray(z, float)
    return gradient / (2.0 * viscosity) * z * (gap - z)


def poiseuille_startup(
    z: ArrayLike, time: ArrayLike, *, gap: float, acceleration: float, kinematic: float
) -> np.ndarray:
    """Velocity [m/s] of liquid at rest that is accelerated along the channel from time 0 on.

    Morris, Fox & Zhu 1997 (J. Comput. Phys. 136, section 4.2). Shapes as `couette_startup`.

    Args:
        acceleration: Force per mass [m/s²].
    """
    steady = poiseuille_steady(z, gap=gap, gradient=acceleration, viscosity=kinematic)
    order = 2 * np.arange(TERMS) + 1
    weight = -4.0 * acceleration * gap**2 / (kinematic * (order * np.pi) ** 3)
    return steady + _sines(z, time, gap, kinematic, order, weight)


def shear_wave(
    amplitude: float, wave_number: float, kinematic: float, time: ArrayLike
) -> np.ndarray:
    """Amplitude [m/s] at `time` of a velocity u_x = a cos(k z), k in 1/m.

    Every Fourier mode of a parallel flow decays by exp(-ν k² t) (Batchelor 1967, section 4.3).
    """
    return amplitude * np.exp(-kinematic * wave_number**2 * np.asarray(time, float))


def spin_up(
    r: ArrayLike, time: ArrayLike, *, radius: float, angular_velocity: float, kinematic: float
) -> np.ndarray:
    """Azimuthal velocity [m/s] in a long cylinder that started to turn at time 0.

    Batchelor 1967, section 4.5: rigid rotation less a Fourier-Bessel series over the zeros of
    J1. Without a floor, which in a shallow cup spins the liquid up sooner. Shapes as
    `couette_startup`, over distances r [m] from the axis.
    """
    zeros = jn_zeros(1, TERMS)
    x = np.asarray(r, float)[:, None] / radius
    modes = 2.0 * angular_velocity * radius * jv(1, zeros * x) / (zeros * jv(0, zeros))
    decay = np.exp(-np.multiply.outer(np.asarray(time, float), kinematic * (zeros / radius) ** 2))
    return angular_velocity * np.asarray(r, float) + decay @ modes.T


def _sines(z, time, gap, kinematic, order, weight) -> np.ndarray:
    """Sum over n of weight sin(nπ z/gap) exp(-n²π² ν t/gap²): [n], or [t, n]."""
    rate = kinematic * (order * np.pi / gap) ** 2
    modes = weight * np.sin(np.multiply.outer(np.asarray(z, float), order * np.pi / gap))
    return np.exp(-np.multiply.outer(np.asarray(time, float), rate)) @ modes.T
