# type: ignore  (Taichi compiles this source and gives these names their types)
"""Viscosity that the effects of a scene change: with time, or from place to place.

A scene without such effects compiles nothing of it.
"""

import taichi as ti

from .lanes import LANES, lanes
from .transfer import strides


@ti.func
def kinematic(s, g, lane, rate, time):
    """Viscosity of a lane's liquid [m²/s] at a shear rate [1/s] and time [s]."""
    nu = s.viscosity[g][lane]
    if ti.static(len(s.rheologies) > 0):
        mu = nu * s.density[g][lane]
        for k in ti.static(range(len(s.rheologies))):
            mu = s.rheologies[k](mu, rate, time, s.coefficient[k, g][lane])
        nu = mu / s.density[g][lane]
    return nu


@ti.func
def find_thickness(s, g, time):
    """Viscosity of each cell [m²/s] at the shear rate that it has now."""
    if ti.static(len(s.rheologies) > 0):
        for n in range(s.nears[g]):
            m = s.near[g, n]
            rate = shear_rate(s, g, m)
            for lane in range(LANES):
                s.thickness[g, m][lane] = kinematic(s, g, lane, rate[lane], time)


@ti.func
def thickness_of(s, g, m):
    nu = s.viscosity[g]
    if ti.static(len(s.rheologies) > 0):
        nu = s.thickness[g, m]
    return nu


@ti.func
def shear_rate(s, g, m):
    """Root of 2 D:D at a cell's centre [1/s], D being the symmetric part of the gradient."""
    S = strides(s)
    total = lanes(0.0)
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        stretch = s.velocity[g, a, m + S[a]] - s.velocity[g, a, m]
        shear = lanes(0.0)  # around the cell's four edges along a
        for k in range(4):
            o = m + (k & 1) * S[b] + (k >> 1) * S[c]
            shear += s.velocity[g, b, o] - s.velocity[g, b, o - S[c]]
            shear += s.velocity[g, c, o] - s.velocity[g, c, o - S[b]]
        total += 2.0 * stretch * stretch + 0.0625 * shear * shear
    return ti.sqrt(total) / s.cell[None]
