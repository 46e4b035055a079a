# type: ignore  (Taichi compiles this source and gives these names their types)
"""From particles to the grid and back: the affine particle-in-cell method.

Jiang, Schroeder, Selle, Teran and Stomakhin (2015), "The affine particle-in-cell method".
"""

import taichi as ti

from ..faults import DRIFTED, LARGEST, RUNAWAY, SOUND, UNSOLVED
from .geometry import INSIDE, OUTSIDE
from .lanes import LANES, lanes, mat3, quad, vec3

LEVEL_GAIN = 4.0
"""A liquid whose mean height is too low by a share x asks for a density less by 4 x: particles that
crowd in cut cells and sink otherwise."""
MOST_DRIFT = 0.02  # of the fill, by which the level moves at most
TOP_SPEED = 20.0  # m/s, ten times what falls from a cup
THICKEST = 1e7
"""Viscosity, in squared cells a step, beyond which a velocity that is no number is put down to it.
Stirs are right up to 1e36 Pa s; beyond, single precision overflows."""
CELLS = 3  # the lattice of cells, beside those of faces along axes 0 to 2
STEEPEST = 0.5  # cells a step over a cell: a steeper slope would hold a lone particle in the air


@ti.func
def strides(s):
    return ti.Vector([1, s.shape[None][0], s.shape[None][0] * s.shape[None][1]])


@ti.func
def place(s, x):
    """The cell that a point (in cells) lies in, and where in it."""
    base = ti.floor(x)
    i = ti.cast(base, ti.i32)
    return i.dot(strides(s)), x - base


@ti.func
def passes(side, there):
    """1 where liquid passes from a side of a wall to those of four places, else 0."""
    return ti.select(side * there == INSIDE * OUTSIDE, quad(0.0), quad(1.0))


@ti.func
def clear(s, g):
    """Empty what the last step has filled."""
    zero = lanes(0.0)
    for n in range(s.arounds[g]):
        m = s.around[g, n]
        s.volume[g, m] = zero
        s.fraction[g, m] = zero
        s.liquid[g, m] = zero
        s.rise[g, m] = zero
        s.cell_search[g, m] = zero
        s.normal_weight[g, m] = zero
        for a in range(3):
            s.velocity[g, a, m] = zero
            s.mass[g, a, m] = zero
            s.search[g, a, m] = zero
            s.shear_weight[g, a, m] = zero
            if ti.static(s.WETTING):  # what tension works in
                s.product[g, a, m] = zero
                s.friction[g, a, m] = zero
                s.rest[g, a, m] = zero
                s.shear[g, a, m] = zero


@ti.func
def mark_cell(s, g, x):
    """Mark the cell at x [m], clamped to the box. NaN is clamped too; its lane fails later."""
    i = ti.cast(ti.floor((x - s.origin[None]) * (1.0 / s.cell[None])), ti.i32)
    s.mark[g, ti.max(ti.min(i, s.shape[None] - 2), 1).dot(strides(s))] = 1


@ti.func
def deposit(s, g):
    """Volumes and momenta of the particles, after the scene's force has acted on them.

    To write four neighbours of a lane at once takes a scratch, from which each cell collects.
    """
    for lane in range(LANES):
        for n in range(s.count[g, lane]):
            s.accelerate(g, lane, n)
            give(s, g, lane, n)
        collect(s, g, lane)


@ti.func
def four(x, y):
    """Bilinear weights of a cell and its next ones along x, y and both."""
    return quad((1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y)


@ti.func
def put(field: ti.template(), g, m, w):
    field[g, m] = field[g, m] + w  # not +=, which is atomic and ten times slower


@ti.func
def give(s, g, lane, n):
    """Put a particle's volume and momentum into the scratch."""
    S, per_cell = strides(s), 1.0 / s.cell[None]
    x = (s.position[g, lane, n] - s.origin[None]) * per_cell
    low, mid = ti.floor(x), ti.floor(x - 0.5)
    first = ti.cast(mid, ti.i32).dot(S)
    up = ti.cast(low - mid, ti.i32)
    volume, slope = s.particle[g][lane], s.slope[g, lane, n]
    side = 0.0
    if ti.static(s.SIDED):
        side = s.side_of(s.position[g, lane, n])
    for a in ti.static(range(CELLS + 1)):
        m, part = first, x - 0.5 - mid
        if ti.static(a < CELLS):
            m += up[a] * S[a]
            part[a] = x[a] - low[a]
        shares, speeds = volume * four(part[0], part[1]), quad(0.0)
        if ti.static(a < CELLS):
            sx, sy = slope[a, 0], slope[a, 1]
            u = s.speed[g, lane, n][a] - (sx * part[0] + sy * part[1] + slope[a, 2] * part[2])
            speeds = quad(u, u + sx, u + sy, u + sx + sy)
        for k in ti.static(range(2)):
            w = shares * (part[2] if ti.static(k) else 1.0 - part[2])
            if ti.static(s.SIDED):
                w *= passes(side, s.side[a, m + k * S[2]])
            put(s.weights[a], g, m + k * S[2], w)
            if ti.static(a < CELLS):
                p = w * ((speeds + slope[a, 2]) if ti.static(k) else speeds)
                put(s.momenta[a], g, m + k * S[2], p)


@ti.func
def take(field: ti.template(), g, m, o):
    """Sum a cell's four shares. Empty the element that no later cell reads."""
    given = field[g, m][0] + field[g, m - 1][1] + field[g, o][2] + field[g, o - 1][3]
    field[g, o - 1] = quad(0.0)
    return given


@ti.func
def collect(s, g, lane):
    """Cells come in order, so that each element is emptied after the last that reads it."""
    for n in range(s.nears[g]):
        m = s.near[g, n]
        o = m - strides(s)[1]
        s.volume[g, m][lane] = take(s.weights[CELLS], g, m, o)
        for a in ti.static(range(3)):
            s.mass[g, a, m][lane] = take(s.weights[a], g, m, o)
            s.velocity[g, a, m][lane] = take(s.momenta[a], g, m, o)


@ti.func
def empty(s, g):
    """Clear the marks and the scratch of an earlier liquid."""
    for m in range(s.cells):
        s.mark[g, m] = 0
        for field in ti.static(s.weights + s.momenta):
            field[g, m] = quad(0.0)


@ti.func
def list_cells(s, g):
    """Cells within one and within two cells of a particle of any lane, in their order."""
    S, shape = strides(s), s.shape[None]
    size = shape[2] * S[2]
    for m in range(size):
        s.spread[g, m] = 0
        s.near[g, m] = 0
    for m in range(2, size - 2):  # bit 0: within one cell, bit 1: within two
        b = s.mark[g, m] | s.mark[g, m - 1] | s.mark[g, m + 1]
        s.spread[g, m] = b | ((b | s.mark[g, m - 2] | s.mark[g, m + 2]) << 1)
    for m in range(2 * S[1], size - 2 * S[1]):
        b = s.spread[g, m] | s.spread[g, m - S[1]] | s.spread[g, m + S[1]]
        far = s.spread[g, m - 2 * S[1]] | s.spread[g, m + 2 * S[1]]
        s.near[g, m] = (b & 1) | ((b | far) & 2)
    for m in range(size):
        b, far = s.near[g, m], 0
        if S[2] <= m and m < size - S[2]:
            b |= s.near[g, m - S[2]] | s.near[g, m + S[2]]
        if 2 * S[2] <= m and m < size - 2 * S[2]:
            far = s.near[g, m - 2 * S[2]] | s.near[g, m + 2 * S[2]]
        s.spread[g, m] = (b & 1) | ((b | far) & 2)
    nears, arounds = 0, 0
    for m in range(size):
        b = s.spread[g, m]
        if b > 0:
            s.mark[g, m] = 0
            s.around[g, arounds] = m
            arounds += 1
            if b & 1 and S[2] <= m and m < size - S[2]:
                s.near[g, nears] = m
                nears += 1
    s.nears[g] = nears
    s.arounds[g] = arounds


@ti.func
def interpolate(s, g, a, lane, x):
    """Value and slope (per cell) of a grid field at a point, in cells of its own lattice."""
    S = strides(s)
    m, part = place(s, x)
    a0, a1 = s.velocity[g, a, m][lane], s.velocity[g, a, m + S[1]][lane]
    a2, a3 = s.velocity[g, a, m + S[2]][lane], s.velocity[g, a, m + S[1] + S[2]][lane]
    d0, d1 = s.velocity[g, a, m + 1][lane] - a0, s.velocity[g, a, m + 1 + S[1]][lane] - a1
    d2 = s.velocity[g, a, m + 1 + S[2]][lane] - a2
    d3 = s.velocity[g, a, m + 1 + S[1] + S[2]][lane] - a3
    a0 += part[0] * d0
    a1 += part[0] * d1
    a2 += part[0] * d2
    a3 += part[0] * d3
    low, high = a0 + part[1] * (a1 - a0), a2 + part[1] * (a3 - a2)
    d_low, d_high = d0 + part[1] * (d1 - d0), d2 + part[1] * (d3 - d2)
    slope = vec3(
        d_low + part[2] * (d_high - d_low),
        (a1 - a0) + part[2] * ((a3 - a2) - (a1 - a0)),
        high - low,
    )
    return low + part[2] * (high - low), slope


@ti.func
def motion_of(s, g, lane, n):
    """Velocity of the flow where a particle is [m/s], and its slope [m/s per cell]."""
    per_cell = 1.0 / s.cell[None]
    x = (s.position[g, lane, n] - s.origin[None]) * per_cell
    steepest = STEEPEST / (s.dt[None] * per_cell)
    v = vec3(0.0)
    slope = mat3(0.0)
    for a in ti.static(range(3)):
        at = x - 0.5
        at[a] += 0.5
        value, gradient = interpolate(s, g, a, lane, at)
        v[a] = value
        for b in ti.static(range(3)):
            slope[a, b] = ti.math.clamp(gradient[b], -steepest, steepest)
    return v, slope


@ti.func
def place_after(s, x, v, slope):
    """Position of a particle after a step, to second order [m]."""
    dt, per_cell = s.dt[None], 1.0 / s.cell[None]
    return x + dt * (v + 0.5 * dt * per_cell * (slope @ v))


@ti.func
def fault_of(s, g, lane, energy, fastest):
    """A lane's fault, by the sum of its particles' squared speeds and the largest of these."""
    fault = SOUND
    if not (energy < LARGEST and fastest < TOP_SPEED**2):  # the sum is no number if any is none
        thick = s.viscosity[g][lane] * s.dt[None] / s.cell[None] ** 2 > THICKEST
        fault = UNSOLVED if thick else RUNAWAY
    return fault


@ti.func
def move(s, g):
    """Velocities and slopes back to the particles, which move, to second order, within the cup.

    A lane that went wrong gets its status and loses its particles.
    """
    for lane in range(LANES):
        height, energy, fastest = 0.0, 0.0, 0.0
        for n in range(s.count[g, lane]):
            v, slope = motion_of(s, g, lane, n)
            s.slope[g, lane, n] = slope
            moved = place_after(s, s.position[g, lane, n], v, slope)
            s.position[g, lane, n], s.speed[g, lane, n] = s.keep_inside(moved, v)
            mark_cell(s, g, s.position[g, lane, n])
            height += s.position[g, lane, n][2]
            energy += v.dot(v)
            fastest = ti.max(fastest, v.dot(v))
        drift = 1.0 - 2.0 * height / ti.max(s.count[g, lane] * s.level[g][lane], 1e-6)
        s.lack[g][lane] = LEVEL_GAIN * drift
        if s.count[g, lane] > 0:
            s.status[g, lane] = fault_of(s, g, lane, energy, fastest)
            if s.status[g, lane] == SOUND and ti.abs(drift) > MOST_DRIFT:
                s.status[g, lane] = DRIFTED
            if s.status[g, lane] != SOUND:
                s.count[g, lane] = 0
