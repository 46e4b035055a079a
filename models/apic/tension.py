# type: ignore  (Taichi compiles this source and gives these names their types)
"""Surface tension as a stress, and Young's force where the surface meets a wall.

The stress is sigma (|g| 1 - g g / |g|) of the gradient g of a colour, 1 in the liquid and 0 outside
(Lafaurie, Nardone, Scardovelli, Zaleski and Zanetti 1994, "Modelling merging and fragmentation in
multiphase flows with SURFER"). So momentum is conserved, and a sheet thinner than a cell still has
two surfaces.

A wall is colour 0: the stress runs on along it, as if the liquid did not wet it at all. Young's
force along the wall, sigma (1 + cos a) towards the dry side, makes the contact angle a.
"""

import taichi as ti

from .lanes import lanes, positive
from .mirror import reflect_cells, reflect_vectors
from .transfer import strides
from .viscosity import add_shear

LEAST_MASS = 0.05  # of a face, in full cells, that tension accelerates


@ti.func
def pull_surface(s, g):
    """What tension does to the velocities in a step.

    It works in fields that the viscosity fills anew: the colour's gradient is in `product`, the
    stress in `rest` (along the axes) and `shear` (around the edges).
    """
    S = strides(s)
    strength = s.tension[g] * s.dt[None] / s.cell[None] ** 2
    if strength.max() > 0.0:
        find_gradient(s, g)
        find_stress(s, g, strength)
        for n in range(s.nears[g]):
            m = s.near[g, n]
            for a in range(3):
                o = m - S[a]
                force = add_shear(s, g, a, m, S, s.rest[g, a, m] - s.rest[g, a, o])
                step = colour(s, g, m) - colour(s, g, o)
                wet = s.wall[a, m] * s.open[m] * s.open[o] * (1.0 + s.cosine[g]) * strength
                push = positive(s.mass[g, a, m]) * (force - wet * step)
                s.velocity[g, a, m] += push / ti.max(s.mass[g, a, m], LEAST_MASS)


@ti.func
def colour(s, g, m):
    """How full a cell is, at most 1; 0 farther than a cell from any particle."""
    return ti.min(s.fraction[g, m], 1.0) * s.open[m]


@ti.func
def find_gradient(s, g):
    """Half the differences of the colour over two cells."""
    S = strides(s)
    for n in range(s.arounds[g]):
        m = s.around[g, n]
        for a in range(3):
            s.product[g, a, m] = lanes(0.0)
            s.rest[g, a, m] = lanes(0.0)
            s.shear[g, a, m] = lanes(0.0)
    reflect_cells(s, g, s.fraction)
    for n in range(s.arounds[g]):  # to all cells where it is not 0, whatever lanes march beside
        m = s.around[g, n]
        if s.open[m] > 0.5:
            for a in range(3):
                here = colour(s, g, m)
                up = step_to_next(here, colour(s, g, m + S[a]), s.passage[a, m + S[a]])
                down = step_to_next(here, colour(s, g, m - S[a]), s.passage[a, m])
                s.product[g, a, m] = 0.5 * (up - down)
    reflect_vectors(s, g, s.product)


@ti.func
def find_stress(s, g, strength):
    S = strides(s)
    for n in range(s.arounds[g]):
        m = s.around[g, n]
        if m >= S[1] + S[2]:
            square = lanes(1e-12)
            for a in range(3):
                square += s.product[g, a, m] * s.product[g, a, m]
            size = ti.sqrt(square)
            for a in range(3):
                along = s.product[g, a, m]
                s.rest[g, a, m] = strength * (square - along * along) / size
                s.shear[g, a, m] = strength * stress_around(s, g, a, m, S)


@ti.func
def step_to_next(here, there, area):
    """Difference of the colour to the next cell; the closed share of the face is a wall, of colour
    0 half a cell away."""
    return area * (there - here) - (1.0 - area) * 2.0 * here


@ti.func
def stress_around(s, g, c, m, S):
    """Stress around a cell's lowest edge along c, by the mean gradient of the cells there.

    On a wall it is 0: all that pulls along walls is Young's force.
    """
    a, b = (c + 1) % 3, (c + 2) % 3
    along, across, third = lanes(0.0), lanes(0.0), lanes(0.0)
    for k in range(4):
        o = m - (k & 1) * S[a] - (k >> 1) * S[b]
        along += s.product[g, a, o]
        across += s.product[g, b, o]
        third += s.product[g, c, o]
    square = along * along + across * across + third * third
    of_a = ti.min(s.passage[a, m], s.passage[a, m - S[b]])
    of_b = ti.min(s.passage[b, m], s.passage[b, m - S[a]])
    return -ti.min(of_a, of_b) * along * across / (4.0 * ti.sqrt(square + 1e-12))
