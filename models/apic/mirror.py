# type: ignore  (Taichi compiles this source and gives these names their types)
"""The plane y = 0 as a mirror: the layer of cells before it holds the image of that behind it."""

import taichi as ti

from .grid import WALL
from .lanes import lanes
from .transfer import strides


@ti.func
def image(s, n):
    """The n-th cell of the layer before the mirror, and the cell that it is the image of."""
    S = strides(s)
    m = n // S[1] * S[2] + (WALL - 1) * S[1] + n % S[1]
    return m, m + S[1]


@ti.func
def images(s):
    return s.shape[None][0] * s.shape[None][2]


@ti.func
def clear_images(s, g):
    """Empty what the last step has filled, farther from particles than `clear` goes."""
    for n in range(images(s)):
        m, _ = image(s, n)
        s.fraction[g, m] = lanes(0.0)
        for a in range(3):
            s.velocity[g, a, m] = lanes(0.0)
            s.product[g, a, m] = lanes(0.0)
            s.friction[g, a, m] = lanes(0.0)


@ti.func
def fold(s, g):
    """Move what particles have deposited before the mirror to where it belongs, behind it."""
    for n in range(images(s)):
        m, o = image(s, n)
        s.volume[g, o] = s.volume[g, o] + s.volume[g, m]
        s.volume[g, m] = lanes(0.0)
        for a in ti.static((0, 2)):
            s.mass[g, a, o] = s.mass[g, a, o] + s.mass[g, a, m]
            s.velocity[g, a, o] = s.velocity[g, a, o] + s.velocity[g, a, m]


@ti.func
def reflect_cells(s, g, x: ti.template()):
    for n in range(images(s)):
        m, o = image(s, n)
        x[g, m] = x[g, o]


@ti.func
def reflect_vectors(s, g, x: ti.template()):
    """Reflect vectors of cells, not of faces."""
    for n in range(images(s)):
        m, o = image(s, n)
        x[g, 0, m] = x[g, 0, o]
        x[g, 1, m] = -x[g, 1, o]
        x[g, 2, m] = x[g, 2, o]


@ti.func
def reflect_velocity(s, g):
    """Reflect velocities, so that nothing passes the mirror."""
    S = strides(s)
    for n in range(images(s)):
        m, o = image(s, n)
        s.velocity[g, 0, m] = s.velocity[g, 0, o]
        s.velocity[g, 2, m] = s.velocity[g, 2, o]
        s.velocity[g, 1, o] = lanes(0.0)
        s.velocity[g, 1, m] = -s.velocity[g, 1, o + S[1]]
