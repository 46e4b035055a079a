# type: ignore  (Taichi compiles this source and gives these names their types)
"""Implicit viscosity with a free surface (Batty and Bridson 2008), and friction of walls."""

import taichi as ti

from .dewetting import wall_hold
from .lanes import chosen, lanes, positive, ratio
from .rheology import (
    LEAST_MASS,
    find_thickness,
    has_velocity,
    thickness_around,
    thickness_between,
    thickness_of,
)
from .transfer import strides

TOLERANCE = 1e-3  # of the speed
LEAST_ENERGY = 1e-3
MOST_ITERATIONS = 200


@ti.func
def has_mass(s, g, a, m):
    return positive(s.mass[g, a, m] - LEAST_MASS)


@ti.func
def weigh_stresses(s, g, step):
    """Weights of the stresses: viscosity by how full their cells are.

    Around an edge that is how full the liquid leaves what walls leave open: particles deposit into
    walls too, so their volume alone would make full liquid thinner there. A stress that a face
    without mass would take part in is 0: its velocity means nothing.
    """
    S = strides(s)
    scale = s.dt[None] / s.cell[None] ** 2
    for n in range(s.arounds[g]):
        m = s.around[g, n]
        for c in range(3):
            s.shear[g, c, m] = lanes(0.0)
    if step == 0:
        find_thickness(s, g, 0.5 * s.dt[None])
    for n in range(s.nears[g]):
        m = s.near[g, n]
        known = lanes(1.0)
        for a in range(3):
            known *= has_velocity(s, g, a, m) * has_velocity(s, g, a, m + S[a])
        nu = scale * thickness_of(s, g, m)
        s.normal_weight[g, m] = nu * ti.min(s.volume[g, m], 1.0) * known
        for c in range(3):  # edges along c
            a, b = (c + 1) % 3, (c + 2) % 3
            full, thick, room = lanes(0.0), lanes(0.0), 1e-6
            for k in range(4):
                o = m - (k & 1) * S[a] - (k >> 1) * S[b]
                full += s.volume[g, o]
                room += s.capacity[o]
                if ti.static(len(s.rheologies) == 0):
                    thick += s.volume[g, o] * s.viscosity[g]
            if ti.static(len(s.rheologies) > 0):
                thick = full * thickness_around(s, g, m, S[a], S[b])
            known_a = has_mass(s, g, a, m) * has_mass(s, g, a, m - S[b])
            known_b = has_mass(s, g, b, m) * has_mass(s, g, b, m - S[a])
            share = s.edge[c, m] * ti.min(1.0 / room, 1.0 / ti.max(full, 1e-6))
            s.shear_weight[g, c, m] = scale * thick * share * known_a * known_b


@ti.func
def find_shear(s, g, u: ti.template()):
    """Stress around the edges, of velocities `u` on the faces."""
    S = strides(s)
    for n in range(s.nears[g]):
        m = s.near[g, n]
        for c in range(3):
            a, b = (c + 1) % 3, (c + 2) % 3
            slip = u[g, a, m] - u[g, a, m - S[b]] + u[g, b, m] - u[g, b, m - S[a]]
            s.shear[g, c, m] = s.shear_weight[g, c, m] * slip


@ti.func
def add_shear(s, g, a, m, S, force):
    """A force on a face, and to it the divergence of the stress around edges."""
    f = force
    for c in range(3):
        if c != a:
            b = 3 - a - c
            f += s.shear[g, c, m + S[b]] - s.shear[g, c, m]
    return f


@ti.func
def force(s, g, u: ti.template(), a, m, S):
    """Divergence of the stress on a face; needs `find_shear` of the same velocities."""
    here = u[g, a, m]
    f = 2.0 * s.normal_weight[g, m] * (u[g, a, m + S[a]] - here)
    f -= 2.0 * s.normal_weight[g, m - S[a]] * (here - u[g, a, m - S[a]])
    return add_shear(s, g, a, m, S, f)


@ti.func
def stiffness(s, g, a, m, S):
    """Diagonal of minus `force`."""
    d = 2.0 * (s.normal_weight[g, m] + s.normal_weight[g, m - S[a]])
    for c in range(3):
        if c != a:
            b = 3 - a - c
            d += s.shear_weight[g, c, m] + s.shear_weight[g, c, m + S[b]]
    return d


@ti.func
def solve_viscosity(s, g, step):
    """Velocities after viscosity, by conjugate gradients, each lane until it has converged.

    What they say of the viscosity holds for the next step.

    `rest` is the residual over the diagonal: to read one field less counts, as memory is the limit.
    """
    S = strides(s)
    zero = lanes(0.0)
    scale = s.dt[None] / s.cell[None] ** 2
    find_shear(s, g, s.velocity)
    rz, energy = zero, zero
    for n in range(s.nears[g]):
        m = s.near[g, n]
        for a in range(3):
            known, u, mass = has_mass(s, g, a, m), s.velocity[g, a, m], s.mass[g, a, m]
            nu = thickness_between(s, g, m, m - S[a])
            rub = s.rub[a, m] * scale * nu
            if ti.static(s.WETTING):
                rub *= wall_hold(s, g, a, m)
            r = known * (force(s, g, s.velocity, a, m, S) - rub * u)
            inverse = ratio(known, mass + rub + stiffness(s, g, a, m, S))
            s.friction[g, a, m] = mass + rub
            s.inverse[g, a, m] = inverse
            s.rest[g, a, m] = inverse * r
            s.search[g, a, m] = inverse * r
            rz += inverse * r * r
            energy += mass * u * u
    goal = TOLERANCE**2 * (energy + LEAST_ENERGY)
    iteration, runs = 0, positive(rz - goal)
    while iteration < MOST_ITERATIONS and runs.max() > 0.0:
        find_shear(s, g, s.search)
        dq = zero
        for n in range(s.nears[g]):
            m = s.near[g, n]
            for a in range(3):
                d = s.search[g, a, m]
                q = s.friction[g, a, m] * d - force(s, g, s.search, a, m, S)
                s.product[g, a, m] = q
                dq += d * q
        alpha = runs * ratio(rz, dq)
        new = zero
        for n in range(s.nears[g]):
            m = s.near[g, n]
            for a in range(3):
                inverse = s.inverse[g, a, m]
                z = s.rest[g, a, m] - alpha * inverse * s.product[g, a, m]
                s.rest[g, a, m] = z
                new += ti.select(inverse > 0.0, z * z / inverse, zero)
        beta = runs * ratio(new, rz)
        rz = chosen(runs, new, rz)
        for n in range(s.nears[g]):
            m = s.near[g, n]
            for a in range(3):
                d = s.search[g, a, m]
                s.velocity[g, a, m] = s.velocity[g, a, m] + alpha * d
                s.search[g, a, m] = s.rest[g, a, m] + beta * d
        iteration += 1
        runs = positive(rz - goal)
    find_thickness(s, g, (step + 1.5) * s.dt[None])


@ti.func
def extend(s, g):
    """Faces without mass and in walls take the mean of their neighbours: particles slip freely."""
    S = strides(s)
    for n in range(s.nears[g]):
        m = s.near[g, n]
        for a in range(3):
            if s.mass[g, a, m].min() <= 0.0:
                total, known = lanes(0.0), lanes(0.0)
                for b in range(3):
                    for o in range(2):
                        there = m + (2 * o - 1) * S[b]
                        has = positive(s.mass[g, a, there])
                        total += has * s.velocity[g, a, there]
                        known += has
                empty = 1.0 - positive(s.mass[g, a, m])
                s.velocity[g, a, m] = chosen(empty, ratio(total, known), s.velocity[g, a, m])
