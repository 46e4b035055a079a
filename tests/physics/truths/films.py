"""Films that flow down a wall under their own weight.

A wall at angle α to the vertical has g cos α in place of g. Surface tension and inertia are left
out.
"""

import numpy as np
from numpy.typing import ArrayLike

from .surfaces import GRAVITY

SLIP = 3.0
"""Logarithm of thickness over slip: 10 if molecules slip, 1 if all of the film does. This is midway
between them, as a ratio."""


def nusselt_velocity(
    across: ArrayLike,
    thickness: float,
    *,
    viscosity: ArrayLike,
    density: float,
    gravity: float = GRAVITY,
) -> np.ndarray:
    """Speed [m/s] down the wall in a steady film: ρ g (h y - y²/2) / μ.

    Nusselt 1916 (Z. Ver. Dtsch. Ing. 60, 541); Batchelor 1967, section 4.2. The wall holds the
    liquid, and nothing rubs on the surface.

    Args:
        across: Distance y from the wall [m], from 0 to `thickness`.
        thickness: h [m].
        viscosity: μ [Pa s]; broadcast against `across`.
    """
    y = np.asarray(across, float)
    return density * gravity * (thickness * y - 0.5 * y**2) / np.asarray(viscosity, float)


def nusselt_flux(
    thickness: ArrayLike, *, viscosity: ArrayLike, density: float, gravity: float = GRAVITY
) -> np.ndarray:
    """Volume that a steady film carries for each width and time [m²/s]: ρ g h³ / (3 μ).

    Its mean speed is this over the thickness h, two thirds of that of its surface.
    """
    h = np.asarray(thickness, float)
    return density * gravity * h**3 / (3.0 * np.asarray(viscosity, float))


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
    tension.

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


def dewetting_speed(
    angle: ArrayLike, *, tension: float, viscosity: ArrayLike, slip: float = SLIP
) -> np.ndarray:
    """Speed [m/s] at which a thin film's edge draws back on a wall: σ a³ / (9 μ ln).

    No film stays behind a faster edge (Voinov 1976, Fluid Dyn. 11, 714). Redon, Brochard-Wyart and
    Rondelez 1991 (Phys. Rev. Lett. 66, 715) measured that it goes as σ a³ / μ, whatever the
    thickness.

    Args:
        angle: Contact angle a [rad].
        tension: σ [N/m].
        viscosity: μ [Pa s]; broadcast against `angle`.
        slip: ln, the logarithm of the film's thickness over the length of slip at its edge.
    """
    cubed = np.asarray(angle, float) ** 3
    return tension * cubed / (9.0 * np.asarray(viscosity, float) * slip)
