"""Liquid surfaces at rest at walls that they meet at a contact angle.

Heights are above the level far from all walls, where the surface is flat. `length` is the
capillary length sqrt(σ / (ρ g)). Walls with an angle below π/2 are wetted, and the liquid rises;
above it sinks, by as much as it rises at the supplement.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.optimize import root_scalar


def mean_rise(gap: ArrayLike, angle: ArrayLike, length: float) -> np.ndarray:
    """Mean height [m] of the surface between two vertical walls: 2 σ cos a / (ρ g d).

    The weight of what was lifted is what the two walls pull, for any gap d. In a narrow gap, a
    capillary, the whole surface is nearly so high (Jurin).

    Args:
        gap: Between the walls, d [m].
        angle: Contact angle a [rad].
    """
    return 2.0 * length**2 * np.cos(np.asarray(angle, float)) / np.asarray(gap, float)


class Meniscus(NamedTuple):
    """Heights [m] of a surface between two walls: halfway, and at the walls."""

    middle: float
    wall: float


def meniscus_between_walls(gap: float, angle: float, length: float) -> Meniscus:
    """The surface between two vertical walls, exact for any gap.

    From the first integral of the Young-Laplace equation over the surface's slope φ, from a
    middle z0 high: z² = z0² + 4 l² s² with s = sin(φ/2), and dx/dφ = l² cos φ / z. With
    2 l s = z0 sinh u this is dx/du = l (1 - 2 s²) / sqrt(1 - s²), smooth for any z0. In a tank
    without liquid outside of the walls, heights above the mean level are these less `mean_rise`.

    Args:
        gap: Between the walls [m].
        angle: Contact angle [rad], from 0 to π.
    """
    if angle == 0.5 * np.pi:
        return Meniscus(0.0, 0.0)
    if angle > 0.5 * np.pi:
        risen = meniscus_between_walls(gap, np.pi - angle, length)
        return Meniscus(-risen.middle, -risen.wall)
    steepest = 2.0 * np.sin(0.5 * (0.5 * np.pi - angle))  # 2 s at the wall

    def too_wide(log_middle: float) -> float:
        middle = float(np.exp(log_middle)) / length

        def ahead(u: float) -> float:
            s = 0.5 * middle * np.sinh(u)
            return (1.0 - 2.0 * s**2) / np.sqrt(1.0 - s**2)

        half, _ = quad(ahead, 0.0, np.arcsinh(steepest / middle), epsrel=1e-10, limit=200)
        return length * half - 0.5 * gap

    # a narrow gap is risen by its mean; in a wide one the middle dies away with the distance
    highest = 2.0 * float(mean_rise(gap, angle, length))
    lowest = 1e-2 * highest * np.exp(-gap / length)
    found = root_scalar(too_wide, bracket=(np.log(lowest), np.log(highest)), xtol=1e-12)
    middle = float(np.exp(found.root))
    return Meniscus(middle, float(np.hypot(middle, steepest * length)))
