# type: ignore  (Taichi compiles this source and gives these names their types)
"""Simulations that march together, and arithmetic on them, entry by entry.

A cell of a field holds a vector with one entry for each simulation of a group, its lane. Plain
loops over cells are then as fast as code that is written for vectors, and lanes never mix. A
thread runs a group from end to end. So a simulation's bits depend neither on its company nor on
the number of threads.
"""

import taichi as ti

LANES = 4
STRIDE = 512  # Taichi gives each CPU thread at least this many consecutive iterations
lanes = ti.types.vector(LANES, ti.f32)
quad = ti.types.vector(4, ti.f32)
vec3 = ti.types.vector(3, ti.f32)
mat3 = ti.types.matrix(3, 3, ti.f32)


@ti.func
def positive(x):
    """1 where x > 0, else 0; 0 where x is not a number."""
    return ti.select(x > 0.0, lanes(1.0), lanes(0.0))


@ti.func
def at_least(x, least):
    """1 where x >= least, else 0."""
    return ti.select(x >= least, lanes(1.0), lanes(0.0))


@ti.func
def ratio(a, b):
    """a / b where b > 0, else 0."""
    return ti.select(b > 1e-20, a / ti.max(b, 1e-20), lanes(0.0))


@ti.func
def chosen(where, a, b):
    """a where `where` is 1, else b."""
    return ti.select(where > 0.5, a, b)
