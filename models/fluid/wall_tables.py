"""What analytic walls and the stick contribute to a particle's kernel sums, by distance.

A wall is a half-space and the stick a long cylinder, both filled with virtual liquid at rest
density. Integrating the kernel over them replaces boundary particles (Koschier & Bender 2017,
"Density maps"): the sums become functions of the distance alone, tabulated once.

Lengths are in units of the kernel's support radius h, so one table serves every resolution.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

ENTRIES = 128  # linear interpolation on this many points errs below 1e-3 of the peak


class BoundaryTable(NamedTuple):
    """Kernel integrals over a boundary, each of shape [ENTRIES], at distances 0 to h.

    Attributes:
        density: Integral of W, the fraction of the rest density that the boundary supplies.
        gradient: Its derivative along the outward normal, in 1/h (negative).
        normal: Integral of -W'/r cos², in 1/h²: viscous coupling along the normal.
        tangential: Integral of -W'/r times half of sin², in 1/h²: along the surface.
    """

    density: np.ndarray
    gradient: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray


def wendland(r: np.ndarray) -> np.ndarray:
    """Wendland C2 kernel in 3-D with support radius 1 (Wendland 1995)."""
    t = np.clip(1.0 - r, 0.0, None)
    return 21.0 / (2.0 * np.pi) * t**4 * (1.0 + 4.0 * r)


def wendland_slope(r: np.ndarray) -> np.ndarray:
    """-W'(r)/r of `wendland`."""
    t = np.clip(1.0 - r, 0.0, None)
    return 21.0 / (2.0 * np.pi) * 20.0 * t**3


@cache
def half_space() -> BoundaryTable:
    """The table of a plane wall, by quadrature over slices parallel to it."""
    fine = np.linspace(0.0, 1.0, 2001)
    step = fine[1]

    def from_support(values: np.ndarray) -> np.ndarray:
        """Integral from each point to the edge of the support."""
        areas = 0.5 * step * (values[1:] + values[:-1])
        return np.append(np.cumsum(areas[::-1])[::-1], 0.0)

    def slices(radial: np.ndarray) -> np.ndarray:
        return from_support(2.0 * np.pi * fine * radial)

    slope = wendland_slope(fine)
    with np.errstate(divide="ignore", invalid="ignore"):
        cos2 = from_support(np.where(fine > 0, 2.0 * np.pi * slope / fine, 0.0)) * fine**2
    total = slices(slope)
    plane = slices(wendland(fine))
    at = np.linspace(0.0, 1.0, ENTRIES)
    columns = (
        from_support(plane),
        -plane,
        from_support(cos2),
        from_support(0.5 * (total - cos2)),
    )
    return BoundaryTable(*(np.interp(at, fine, column) for column in columns))


@cache
def cylinder(radius: float) -> BoundaryTable:
    """The table of a long cylinder of `radius` [h], by distance from its surface.

    `tangential` is the mean of the couplings around and along the cylinder.
    """
    rho = np.linspace(0.0, 1.0, 257)
    z = np.linspace(-1.0, 1.0, 401)
    r = np.hypot(rho[:, None], z)
    line = np.trapezoid(wendland(r), z, axis=1)
    slope_line = np.trapezoid(wendland_slope(r), z, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        axial = np.where(r > 0, wendland_slope(r) * z**2 / r**2, 0.0)
    axial_line = np.trapezoid(axial, z, axis=1)

    a = (np.arange(64) + 0.5) / 64 * radius
    phi = (np.arange(128) + 0.5) / 128 * 2.0 * np.pi
    area = (a * radius / 64 * 2.0 * np.pi / 128)[:, None] * np.ones_like(phi)
    x, y = a[:, None] * np.cos(phi), a[:, None] * np.sin(phi)
    at = np.linspace(0.0, 1.0, ENTRIES)
    density, normal, tangential = np.zeros((3, ENTRIES))
    for k, distance in enumerate(at + radius):
        d = np.hypot(distance - x, y)
        cos2 = ((distance - x) / d) ** 2
        across = np.interp(d, rho, slope_line - axial_line, right=0.0)
        density[k] = np.sum(area * np.interp(d, rho, line, right=0.0))
        normal[k] = np.sum(area * across * cos2)
        around = np.sum(area * across * (1.0 - cos2))
        along = np.sum(area * np.interp(d, rho, axial_line, right=0.0))
        tangential[k] = 0.5 * (around + along)
    return BoundaryTable(density, np.gradient(density, at), normal, tangential)


def over_half_space(values: np.ndarray, nearest: float) -> float:
    """Integral [h] of a column of `half_space()` over distances from `nearest` [h] on."""
    at = np.linspace(nearest, 1.0, ENTRIES)
    return float(np.trapezoid(np.interp(at, np.linspace(0.0, 1.0, ENTRIES), values), at))


def around_cylinder(values: np.ndarray, radius: float) -> float:
    """Integral [h²] of a column of `cylinder(radius)` over a plane across, outside the cylinder."""
    r = radius + np.linspace(0.0, 1.0, ENTRIES)
    return float(np.trapezoid(2.0 * np.pi * r * values, r))
