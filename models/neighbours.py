# type: ignore  (Taichi compiles this source and gives these names their types)
"""Who is near whom: half neighbour lists of a batch of particle sets, by counting sort."""

import numpy as np
import taichi as ti

vec3 = ti.math.vec3
MEAN_NEIGHBOURS = 40  # of a half list; settled liquid has about 17


@ti.data_oriented
class NeighbourSearch:
    """Pairs of `predicted` positions closer than `reach`, each listed once.

    One thread searches one particle set, in a fixed order, so lists are the same in any batch.
    Particle i = order[b, a] meets pair_other[b, k] for k in pair_start[b, a] to
    pair_start[b, a + 1] - 1.
    """

    def __init__(self, slots, particles, reach, extent):
        """
        Args:
            slots: Particle sets that are searched side by side.
            particles: Particles of a set, at most; the first `alive[b]` take part.
            reach: Largest distance of neighbours [m].
            extent: Lower and upper corner of the grid [m]; particles may leave it.
        """
        lower, upper = np.asarray(extent, dtype=float)
        self.slots, self.particles, self.reach = slots, particles, reach
        self.origin = tuple(lower)
        self.cells = tuple(int(n) for n in np.ceil((upper - lower) / reach))
        self.capacity = MEAN_NEIGHBOURS * particles
        shape = (slots, particles)
        self.predicted, self.sorted = (ti.Vector.field(3, ti.f32, shape) for _ in range(2))
        self.order, self.cell = (ti.field(ti.i32, shape) for _ in range(2))
        self.cell_start = ti.field(ti.i32, (slots, int(np.prod(self.cells)) + 1))
        self.pair_start = ti.field(ti.i32, (slots, particles + 1))
        self.pair_other = ti.field(ti.i32, (slots, self.capacity))
        self.alive, self.overflow = (ti.field(ti.i32, slots) for _ in range(2))

    @ti.func
    def cell_of(self, p):
        """Grid cell of a point; clamping keeps neighbours in neighbouring cells."""
        nx, ny, nz = ti.static(self.cells)
        q = ti.floor((p - vec3(*self.origin)) / self.reach, ti.i32)
        return ti.math.clamp(q, ti.Vector([0, 0, 0]), ti.Vector([nx - 1, ny - 1, nz - 1]))

    @ti.func
    def search(self, b):
        """Half neighbour lists of the predicted positions, by counting sort."""
        nx, ny, nz = ti.static(self.cells)
        for c in range(nx * ny * nz + 1):
            self.cell_start[b, c] = 0
        for i in range(self.alive[b]):
            q = self.cell_of(self.predicted[b, i])
            c = (q[0] * ny + q[1]) * nz + q[2]
            self.cell[b, i] = c
            self.cell_start[b, c] = self.cell_start[b, c] + 1
        total = 0
        for c in range(nx * ny * nz + 1):
            total += self.cell_start[b, c]
            self.cell_start[b, c] = total
        for k in range(self.alive[b]):
            i = self.alive[b] - 1 - k
            c = self.cell[b, i]
            a = self.cell_start[b, c] - 1
            self.cell_start[b, c] = a
            self.order[b, a] = i
            self.sorted[b, a] = self.predicted[b, i]
        pairs = 0
        for a in range(self.alive[b]):
            self.pair_start[b, a] = pairs
            p = self.sorted[b, a]
            q = self.cell_of(p)
            column = (q[0] * ny + q[1]) * nz
            pairs = self.collect(
                b, p, a + 1, self.cell_start[b, column + ti.min(q[2] + 1, nz - 1) + 1], pairs
            )
            for k in ti.static(range(4)):
                dx, dy = ti.static(((0, 1), (1, -1), (1, 0), (1, 1))[k])
                if q[0] + dx < nx and 0 <= q[1] + dy and q[1] + dy < ny:
                    other = column + (dx * ny + dy) * nz
                    low = self.cell_start[b, other + ti.max(q[2] - 1, 0)]
                    high = self.cell_start[b, other + ti.min(q[2] + 1, nz - 1) + 1]
                    pairs = self.collect(b, p, low, high, pairs)
        self.pair_start[b, self.alive[b]] = pairs

    @ti.func
    def collect(self, b, p, low, high, pairs):
        """Append the sorted particles low..high-1 that lie within h of p; the new count."""
        count = pairs
        for a in range(low, high):
            d = p - self.sorted[b, a]
            if d.dot(d) < self.reach * self.reach:
                if count < self.capacity:
                    self.pair_other[b, count] = self.order[b, a]
                    count += 1
                else:
                    self.overflow[b] = 1
        return count

    def check_capacity(self):
        """
        Raises:
            RuntimeError: neighbour lists overflowed since `overflow` was cleared.
        """
        if self.overflow.to_numpy().any():
            raise RuntimeError(
                f"particles have more than {MEAN_NEIGHBOURS} neighbours on average: the liquid "
                "has collapsed; raise numerics.rate or lower cohesion"
            )
