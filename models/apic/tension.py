# type: ignore  (Taichi compiles this source and gives these names their types)
"""Surface tension as a stress, and Young's force where the surface meets a wall.

The stress is sigma (|g| 1 - g g / |g|) of the gradient g of a colour, 1 in the liquid and 0 outside
(Lafaurie, Nardone, Scardovelli, Zaleski and Zanetti 1994, "Modelling merging and fragmentation in
multiphase flows with SURFER"). So momentum is conserved, and a sheet thinner than a cell still has
two surfaces.

A wall is colour 0: the stress runs on along it, as if the liquid did not wet it at all. Young's
force along the wall, sigma (1 + cos a) towards the dry side, makes the contact angle a. The
gradient towards walls has a stress of its own: in a film of one cell it would cancel that of the
free surface, and where a surface meets a wall it would round the corner.
"""

import taichi as ti

from .lanes import at_least, chosen, lanes, positive
from .mirror import reflect_cells, reflect_vectors
from .surface import LIQUID, to_surface
from .transfer import strides
from .viscosity import add_shear

FULL = 0.75
"""Share of its capacity from which a cell has no surface: within liquid particles lie unevenly, and
where they are few is nothing that pulls."""
LEAST_MASS = 0.05  # of a face, in full cells, that tension accelerates


@ti.func
def pull_surface(s, g):
    """Change the velocities by a step's surface tension.

    It works in fields that the viscosity fills anew: the colour's gradients to free surfaces and to
    walls are in `product` and `friction`, the stress in `rest` (along the axes) and `shear` (around
    the edges), at last the forces in `product`. All of these are 0 farther than two cells from any
    particle, so that it does not matter which lanes march beside.
    """
    S = strides(s)
    strength = s.tension[g] * s.dt[None] / s.cell[None] ** 2
    if strength.max() > 0.0:
        find_gradients(s, g)
        add_stress(s, g, s.product, strength)
        add_stress(s, g, s.friction, strength)
        for n in range(s.arounds[g]):
            m = s.around[g, n]
            for a in range(3):
                force = lanes(0.0)
                if s.carries[a, m] > 0.0:
                    o = m - S[a]
                    wet = s.wall[a, m] * s.open[m] * s.open[o] * (1.0 + s.cosine[g]) * strength
                    force = add_shear(s, g, a, m, S, s.rest[g, a, m] - s.rest[g, a, o])
                    force -= wet * (colour(s, g, m) - colour(s, g, o))
                    force *= positive(s.fraction[g, m] + s.fraction[g, o])  # known to all lanes
                    force /= ti.max(takers(s, g, a, m, S[a]), 1.0)
                s.product[g, a, m] = force
        accelerate(s, g)


@ti.func
def colour(s, g, m):
    """1 in full cells, less in emptier ones; 0 farther than a cell from any particle."""
    return ti.min(s.fraction[g, m] / FULL, 1.0) * s.open[m]


@ti.func
def accelerate(s, g):
    """Velocities of faces by the forces on them, in `product`.

    The forces at a surface reach a cell beyond it, where little or no liquid is and no pressure
    holds it. The liquid would bear half of its tension, and its skin would fly inward. So a surface
    of filled cells takes what acts on the two faces beyond it, and its own, as the pressure that it
    is under. Where no cell is filled, in films and sheets, each face keeps its force.
    """
    S = strides(s)
    for n in range(s.arounds[g]):
        m = s.around[g, n]
        for a in range(3):
            if s.carries[a, m] > 0.0:
                o = m - S[a]
                above, below = filled(s, g, m), filled(s, g, o)
                on_surface = ti.abs(above - below)
                force = s.product[g, a, m]
                force += on_surface * above * beyond(s, g, a, o, -S[a])
                force += on_surface * below * beyond(s, g, a, m + S[a], S[a])
                far = to_surface(s.fraction[g, m], s.fraction[g, o])
                mass = ti.max(s.mass[g, a, m], LEAST_MASS)
                kept = positive(1.0 - takers(s, g, a, m, S[a])) * force
                s.velocity[g, a, m] = s.velocity[g, a, m] + kept / chosen(on_surface, far, mass)


@ti.func
def filled(s, g, m):
    return s.open[m] * at_least(s.fraction[g, m], LIQUID)


@ti.func
def beyond(s, g, a, face, step):
    """Force that acts on the next two faces beyond a surface; no wall and no other filled cell is
    passed."""
    further = ti.min(face, face + step)  # the cell behind the face
    first = s.carries[a, face] * (1.0 - filled(s, g, further))
    second = s.carries[a, face + step] * (1.0 - filled(s, g, further + step))
    return first * (s.product[g, a, face] + second * s.product[g, a, face + step])


@ti.func
def takers(s, g, a, m, step):
    """Number of surfaces that take the force on a face: 0 to 2, and 0 if it is one itself."""
    o = m - step
    neither = (1.0 - filled(s, g, m)) * (1.0 - filled(s, g, o))
    return neither * (near_filled(s, g, a, m, step) + near_filled(s, g, a, o, -step))


@ti.func
def near_filled(s, g, a, cell, step):
    """Whether one of the next two cells is filled, 1 or 0, and no wall stands between."""
    there = cell + step
    first, second = ti.max(cell, there), ti.max(there, there + step)  # the faces on the way
    is_second = s.carries[a, second] * filled(s, g, there + step)
    return s.carries[a, first] * ti.max(filled(s, g, there), is_second)


@ti.func
def find_gradients(s, g):
    """Find the gradients of the colour."""
    S = strides(s)
    reflect_cells(s, g, s.fraction)
    for n in range(s.arounds[g]):
        m = s.around[g, n]
        if s.open[m] > 0.5:
            here = colour(s, g, m)
            for a in range(3):
                below, above = s.passage[a, m], s.passage[a, m + S[a]]
                up = above * (colour(s, g, m + S[a]) - here)
                down = below * (here - colour(s, g, m - S[a]))
                s.product[g, a, m] = 0.5 * (up + down)
                s.friction[g, a, m] = (above - below) * here  # walls are half a cell away
    reflect_vectors(s, g, s.product)
    reflect_vectors(s, g, s.friction)


@ti.func
def add_stress(s, g, gradient: ti.template(), strength):
    S = strides(s)
    for n in range(s.arounds[g]):
        m = s.around[g, n]
        if m >= S[1] + S[2]:
            square = lanes(1e-12)
            for a in range(3):
                square += gradient[g, a, m] * gradient[g, a, m]
            size = ti.sqrt(square)
            for a in range(3):
                along = gradient[g, a, m]
                pull = strength * (square - along * along) / size
                s.rest[g, a, m] = s.rest[g, a, m] + pull
                around = strength * stress_around(s, g, gradient, a, m, S)
                s.shear[g, a, m] = s.shear[g, a, m] + around


@ti.func
def stress_around(s, g, gradient: ti.template(), c, m, S):
    """Stress around a cell's lowest edge along c, by the mean gradient of the cells there.

    On a wall it is 0: all that pulls along walls is Young's force.
    """
    a, b = (c + 1) % 3, (c + 2) % 3
    along, across, third = lanes(0.0), lanes(0.0), lanes(0.0)
    for k in range(4):
        o = m - (k & 1) * S[a] - (k >> 1) * S[b]
        along += gradient[g, a, o]
        across += gradient[g, b, o]
        third += gradient[g, c, o]
    square = along * along + across * across + third * third
    of_a = ti.min(s.passage[a, m], s.passage[a, m - S[b]])
    of_b = ti.min(s.passage[b, m], s.passage[b, m - S[a]])
    return -ti.min(of_a, of_b) * along * across / (4.0 * ti.sqrt(square + 1e-12))
