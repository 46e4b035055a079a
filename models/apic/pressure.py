# type: ignore  (Taichi compiles this source and gives these names their types)
"""Pressure: what the last step's left over is pushed by, and an increment that is solved for."""

import taichi as ti

from .lanes import chosen, lanes, positive, ratio
from .surface import to_surface
from .transfer import strides

LEAST_SPEED = 0.02  # m/s, that the divergence left over is relative to
MOST_ITERATIONS = 150


@ti.func
def push(s, g, p: ti.template()):
    """Velocities less the gradient of a pressure, which is 0 on the surface, where that is."""
    S = strides(s)
    for n in range(s.arounds[g]):  # all faces of liquid cells, whatever lanes march beside
        m = s.around[g, n]
        for a in range(3):
            if s.area[a, m] > 0.0:
                o = m - S[a]
                slope = p[g, m] - p[g, o]
                far = to_surface(s.fraction[g, m], s.fraction[g, o])
                on_surface = ti.abs(s.liquid[g, m] - s.liquid[g, o])
                s.velocity[g, a, m] = s.velocity[g, a, m] - chosen(on_surface, slope / far, slope)


@ti.func
def solve_pressure(s, g):
    """The increment, by conjugate gradients from 0, each lane until it has converged."""
    S = strides(s)
    zero = lanes(0.0)
    rz, cells = zero, zero
    for n in range(s.wets[g]):
        m = s.wet[g, n]
        b = s.source[g, m]
        for a in range(3):
            b -= s.area[a, m + S[a]] * s.velocity[g, a, m + S[a]]
            b += s.area[a, m] * s.velocity[g, a, m]
        b *= s.liquid[g, m]
        z = b / s.diagonal[g, m]
        s.cell_rest[g, m] = b
        s.cell_search[g, m] = z
        s.rise[g, m] = zero
        rz += b * z
        cells += s.liquid[g, m]
    goal = ti.static(s.TOLERANCE**2) * (cells * (LEAST_SPEED**2 / 6.0) + 1e-9)
    iteration, runs = 0, positive(rz - goal)
    while iteration < MOST_ITERATIONS and runs.max() > 0.0:
        dq = zero
        for n in range(s.wets[g]):
            m = s.wet[g, n]
            d = s.cell_search[g, m]
            q, above = s.diagonal[g, m] * d, zero
            for a in range(3):
                q -= s.coupling[g, a, m] * s.cell_search[g, m - S[a]]
                above += s.area[a, m + S[a]] * s.cell_search[g, m + S[a]]
            q = s.liquid[g, m] * (q - above)
            s.cell_product[g, m] = q
            dq += d * q
        alpha = runs * ratio(rz, dq)
        new = zero
        for n in range(s.wets[g]):
            m = s.wet[g, n]
            s.rise[g, m] = s.rise[g, m] + alpha * s.cell_search[g, m]
            r = s.cell_rest[g, m] - alpha * s.cell_product[g, m]
            s.cell_rest[g, m] = r
            new += r * r / s.diagonal[g, m]
        beta = runs * ratio(new, rz)
        rz = chosen(runs, new, rz)
        for n in range(s.wets[g]):
            m = s.wet[g, n]
            z = s.cell_rest[g, m] / s.diagonal[g, m]
            s.cell_search[g, m] = z + beta * s.cell_search[g, m]
        iteration += 1
        runs = positive(rz - goal)


@ti.func
def add_rise(s, g):
    for n in range(s.wets[g]):
        m = s.wet[g, n]
        s.pressure[g, m] = (s.pressure[g, m] + s.rise[g, m]) * s.liquid[g, m]
