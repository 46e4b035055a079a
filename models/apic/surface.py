# type: ignore  (Taichi compiles this source and gives these names their types)
"""Which cells are liquid, where between cells the surface lies, and what pressure must mend."""

import taichi as ti

from .lanes import at_least, chosen, lanes, ratio
from .transfer import strides

LIQUID = 0.5  # share of its capacity from which a cell is liquid
NEAREST_SURFACE = 0.15  # cells between a cell's centre and the surface, at least
MOST_WRONG = 0.5  # density error that is mended, at most


@ti.func
def to_surface(a, b):
    """Distance from a liquid cell's centre to the surface before the next one, in cells.

    Exact for a flat surface, by the fractions of both as particles deposit them.
    """
    return ti.math.clamp(a + b - 0.5, NEAREST_SURFACE, 1.0)


@ti.func
def find_liquid(s, g):
    """Velocities from momenta, fractions, and cells that are liquid."""
    S = strides(s)
    for n in range(s.nears[g]):
        m = s.near[g, n]
        for a in range(3):
            s.mass[g, a, m] = s.mass[g, a, m] * s.carries[a, m]
            s.velocity[g, a, m] = ratio(s.velocity[g, a, m], s.mass[g, a, m])
        s.fraction[g, m] = s.volume[g, m] / s.capacity[m]
        s.liquid[g, m] = s.usable[m] * at_least(s.fraction[g, m], s.least[m])
    if ti.static(s.UPRIGHT):
        # what lies under liquid is liquid: as air, at pressure 0, it would suck at depth
        for k in range(s.nears[g]):
            m = s.near[g, s.nears[g] - 1 - k]
            if s.usable[m] > 0.5 and s.area[2, m + S[2]] > 0.0:
                s.liquid[g, m] = ti.max(s.liquid[g, m], s.liquid[g, m + S[2]])
    wets = 0
    for n in range(s.arounds[g]):
        m = s.around[g, n]
        s.pressure[g, m] = s.pressure[g, m] * s.liquid[g, m]
        if s.liquid[g, m].sum() > 0.0:
            s.wet[g, wets] = m
            wets += 1
    s.wets[g] = wets


@ti.func
def set_up_pressure(s, g):
    """Coefficients of the pressure's equation, and the divergence that mends the density.

    The surface is where `to_surface` says (ghost fluid, Enright, Nguyen, Gibou and Fedkiw 2003).
    """
    S = strides(s)
    one = lanes(1.0)
    rate = s.cell[None] / ti.static(s.MENDING_TIME)
    for n in range(s.wets[g]):
        m = s.wet[g, n]
        here, liquid = s.fraction[g, m], s.liquid[g, m]
        total, to_air = lanes(0.0), lanes(0.0)
        for a in range(3):
            below, above = s.area[a, m], s.area[a, m + S[a]]
            before, after = s.liquid[g, m - S[a]], s.liquid[g, m + S[a]]
            s.coupling[g, a, m] = below * liquid * before
            total += below * (before + (one - before) / to_surface(here, s.fraction[g, m - S[a]]))
            total += above * (after + (one - after) / to_surface(here, s.fraction[g, m + S[a]]))
            to_air += below * (one - before) + above * (one - after)
        # a surface cell may hold less than its fill, not more
        least = ti.select(to_air < 0.01, lanes(-MOST_WRONG), lanes(0.0))
        wrong = ti.min(ti.max(here - 1.0 + s.lack[g], least), MOST_WRONG)
        s.diagonal[g, m] = chosen(liquid, ti.max(total, 1e-3), one)
        s.source[g, m] = rate * s.open_volume[m] * wrong * liquid
