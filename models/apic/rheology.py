# type: ignore  (Taichi compiles this source and gives these names their types)
"""Viscosity that the effects of a scene change: with time, or from place to place.

A scene without such effects compiles nothing of it.
"""

import taichi as ti

from .lanes import LANES, lanes, positive, ratio
from .transfer import strides

LEAST_MASS = 1e-4  # of a face, in full cells, that has a velocity


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
    """Viscosity [m²/s] at a time [s] of each cell that liquid may come into in a step.

    The shear rate is that of velocities right after the viscous solve. What the mending of density
    and the transfer of particles add to velocities later has slopes of several 1/s from cell to
    cell, which are no shear of the liquid; viscosity damps them at once. Cells that liquid enters
    have the viscosity at rest for a step.
    """
    if ti.static(len(s.rheologies) > 0):
        for n in range(s.arounds[g]):
            m = s.around[g, n]
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
def thickness_around(s, g, m, along_a, along_b):
    """Viscosity around the edge at a cell's lower corner, of four cells by their liquid [m²/s].

    The mean is harmonic: a gel's viscosity goes as one over the rate, so it is that of the mean
    rate. An arithmetic one would let a plug hold what flows beside it.
    """
    full, thin = lanes(0.0), lanes(0.0)
    for k in range(4):
        o = m - (k & 1) * along_a - (k >> 1) * along_b
        full += s.volume[g, o]
        thin += ratio(s.volume[g, o], s.thickness[g, o])
    return ratio(full, thin)


@ti.func
def thickness_between(s, g, m, o):
    """Viscosity between two cells, by the same mean [m²/s]."""
    nu = s.viscosity[g]
    if ti.static(len(s.rheologies) > 0):
        full = s.volume[g, m] + s.volume[g, o]
        thin = ratio(s.volume[g, m], s.thickness[g, m])
        thin += ratio(s.volume[g, o], s.thickness[g, o])
        nu = ratio(full, thin)
    return nu


@ti.func
def has_velocity(s, g, a, m):
    """1 for a face of liquid or in a wall, else 0."""
    return positive(s.mass[g, a, m] + s.shut[a, m] - LEAST_MASS)


@ti.func
def shear_rate(s, g, m):
    """Root of 2 D:D at a cell's centre [1/s], D being the symmetric part of the gradient.

    Faces in the air have no velocity, and what they take part in tells nothing.
    """
    S = strides(s)
    total = lanes(0.0)
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        both = has_velocity(s, g, a, m) * has_velocity(s, g, a, m + S[a])
        stretch = both * (s.velocity[g, a, m + S[a]] - s.velocity[g, a, m])
        shear, known = lanes(0.0), lanes(0.0)  # around the cell's four edges along a
        for k in range(4):
            o = m + (k & 1) * S[b] + (k >> 1) * S[c]
            four = has_velocity(s, g, b, o) * has_velocity(s, g, b, o - S[c])
            four *= has_velocity(s, g, c, o) * has_velocity(s, g, c, o - S[b])
            slip = s.velocity[g, b, o] - s.velocity[g, b, o - S[c]]
            slip += s.velocity[g, c, o] - s.velocity[g, c, o - S[b]]
            shear += four * slip
            known += four
        mean = ratio(shear, known)
        total += 2.0 * stretch * stretch + mean * mean
    return ti.sqrt(total) / s.cell[None]
