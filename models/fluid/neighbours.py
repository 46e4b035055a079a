# type: ignore  (Taichi compiles this source and gives these names their types)
"""Who is near whom: particles sorted by place, and the neighbours of each."""

import numpy as np
import taichi as ti

from .faults import COLLAPSED

vec3 = ti.math.vec3
MEAN_NEIGHBOURS = 40  # of a half list; settled liquid has about 14
FLAT = 3  # layers of cells in one reach: a column's neighbours lie in one run, the thinner the less


@ti.data_oriented
class NeighbourSearch:
    """Pairs of particles closer than `reach`, in a batch of particle sets.

    `search` first sorts a set's particles by grid cell, so that neighbours are near in memory
    too: particles have no lasting number. The neighbours of particle i are then pair_other[b, k]
    for k from pair_start[b, i] to pair_start[b, i + 1] - 1, and each pair is listed twice.

    One thread searches one set, in a fixed order, so lists are the same in any batch.
    """

    def __init__(self, slots, particles, reach, extent, period=(0.0, 0.0)):
        """
        Args:
            slots: Particle sets that are searched side by side.
            particles: Particles of a set, at most; the first `alive[b]` take part.
            reach: Largest distance of neighbours [m].
            extent: Lower and upper corner of the grid [m]; particles may leave it.
            period: Length after which the set repeats along x and y [m]; 0: it does not.
        """
        lower, upper = np.asarray(extent, dtype=float)
        self.slots, self.particles, self.reach = slots, particles, reach
        self.origin, self.period = tuple(lower), tuple(period)
        self.cells, self.cell_size = _grid(reach, upper - lower, period)
        self.capacity = 2 * MEAN_NEIGHBOURS * particles
        shape = (slots, particles)
        self.position = ti.Vector.field(3, ti.f32, shape)
        self.cell = ti.field(ti.i32, shape)
        self.cell_start = ti.field(ti.i32, (slots, int(np.prod(self.cells)) + 1))
        self.half_start, self.pair_start, self.pair_next = (
            ti.field(ti.i32, (slots, particles + 1)) for _ in range(3)
        )
        self.half_other = ti.field(ti.i32, (slots, self.capacity // 2))
        self.pair_other = ti.field(ti.i32, (slots, self.capacity))
        self.alive, self.fault = (ti.field(ti.i32, slots) for _ in range(2))
        self.carried, self.scratch = [], []
        self.carry(self.position, ti.Vector.field(3, ti.f32, shape))

    def carry(self, field, scratch):
        """Let `field` of shape [slots, particles] move with its particles; `scratch` is alike."""
        self.carried.append(field)
        self.scratch.append(scratch)

    @ti.func
    def cell_of(self, p):
        """Grid cell of a point; clamping keeps neighbours in neighbouring cells."""
        nx, ny, nz = ti.static(self.cells)
        sx, sy, sz = ti.static(self.cell_size)
        q = ti.floor((p - vec3(*self.origin)) / vec3(sx, sy, sz), ti.i32)
        return ti.math.clamp(q, ti.Vector([0, 0, 0]), ti.Vector([nx - 1, ny - 1, nz - 1]))

    @ti.func
    def apart(self, p, q):
        """p - q, the shortest way round where the set repeats."""
        d = p - q
        for axis in ti.static(range(2)):
            if ti.static(self.period[axis] > 0):
                length = ti.static(self.period[axis])
                d[axis] -= length * ti.round(d[axis] / length)
        return d

    @ti.func
    def search(self, b):
        """Sort the particles and list the neighbours."""
        self.sort(b)
        self.list_halves(b)
        self.list_both(b)

    @ti.func
    def sort(self, b):
        """Counting sort by cell."""
        nx, ny, nz = ti.static(self.cells)
        alive = self.alive[b]
        for c in range(nx * ny * nz + 1):
            self.cell_start[b, c] = 0
        for i in range(alive):
            q = self.cell_of(self.position[b, i])
            c = (q[0] * ny + q[1]) * nz + q[2]
            self.cell[b, i] = c
            self.cell_start[b, c] = self.cell_start[b, c] + 1
        total = 0
        for c in range(nx * ny * nz + 1):
            total += self.cell_start[b, c]
            self.cell_start[b, c] = total
        for k in range(alive):
            i = alive - 1 - k
            c = self.cell[b, i]
            a = self.cell_start[b, c] - 1
            self.cell_start[b, c] = a
            for f in ti.static(range(len(self.carried))):
                self.scratch[f][b, a] = self.carried[f][b, i]
        for i in range(alive):
            for f in ti.static(range(len(self.carried))):
                self.carried[f][b, i] = self.scratch[f][b, i]

    @ti.func
    def list_halves(self, b):
        """Each pair once, in `half_other`, from `half_start`."""
        nx, ny, nz = ti.static(self.cells)
        pairs = 0
        for i in range(self.alive[b]):
            self.half_start[b, i] = pairs
            p = self.position[b, i]
            q = self.cell_of(p)
            for k in range(5):  # this column, the next in y, and the three next in x
                x, y = q[0] + ti.select(k < 2, 0, 1), q[1] + ti.select(k < 2, k, k - 3)
                if ti.static(self.period[0] > 0):
                    x = (x + nx) % nx
                if ti.static(self.period[1] > 0):
                    y = (y + ny) % ny
                if x < nx and 0 <= y and y < ny:
                    column = (x * ny + y) * nz
                    low = self.cell_start[b, column + ti.max(q[2] - FLAT, 0)]
                    if k == 0:
                        low = i + 1
                    high = self.cell_start[b, column + ti.min(q[2] + FLAT, nz - 1) + 1]
                    pairs = self.collect(b, p, low, high, pairs)
        self.half_start[b, self.alive[b]] = pairs

    @ti.func
    def collect(self, b, p, low, high, pairs):
        """Append the particles low..high-1 that lie within reach of p; the new count.

        Always written, counted if near: a branch that cannot be foretold costs seven times more.
        """
        count = pairs
        for a in range(low, high):
            d = self.apart(p, self.position[b, a])
            self.half_other[b, count] = a
            count += ti.cast(d.dot(d) < self.reach * self.reach, ti.i32)
        if count > self.capacity // 2 - self.particles:
            self.fault[b] = COLLAPSED
            count = pairs
        return count

    @ti.func
    def list_both(self, b):
        """Each pair from both its ends."""
        alive = self.alive[b]
        for i in range(alive):
            self.pair_next[b, i] = self.half_start[b, i + 1] - self.half_start[b, i]
        for k in range(self.half_start[b, alive]):
            j = self.half_other[b, k]
            self.pair_next[b, j] = self.pair_next[b, j] + 1
        total = 0
        for i in range(alive):
            count = self.pair_next[b, i]
            self.pair_start[b, i] = total
            self.pair_next[b, i] = total
            total += count
        self.pair_start[b, alive] = total
        for i in range(alive):
            own = self.pair_next[b, i]
            for k in range(self.half_start[b, i], self.half_start[b, i + 1]):
                j = self.half_other[b, k]
                self.pair_other[b, own] = j
                own += 1
                theirs = self.pair_next[b, j]
                self.pair_other[b, theirs] = i
                self.pair_next[b, j] = theirs + 1
            self.pair_next[b, i] = own


def _grid(reach, size, period):
    """Numbers and sizes of the cells [m] along x, y and z."""
    cells, sizes = [], []
    for length, repeats in zip(size[:2], period, strict=True):
        n = int(length / reach) if repeats > 0 else int(np.ceil(length / reach))
        if repeats > 0 and n < 3:
            raise ValueError(f"a period of {repeats} m is less than three reaches of {reach} m")
        cells.append(max(n, 1))
        sizes.append(repeats / n if repeats > 0 else reach)
    layers = int(np.ceil(FLAT * size[2] / reach))
    return (*cells, max(layers, 1)), (*sizes, reach / FLAT)
