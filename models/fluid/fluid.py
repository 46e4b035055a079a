# type: ignore  (Taichi compiles this source and gives these names their types)
"""A batch of particle liquids: one substep of incompressible, viscous, cohesive flow.

Kernel sums are those of smoothed particle hydrodynamics with the Wendland C2 kernel; walls are
tables (`tables`). One thread runs one simulation from end to end, in a fixed order, so a
simulation's bits depend neither on the batch nor on the number of threads.
"""

import numpy as np
import taichi as ti

from .attraction import Attraction
from .faults import LARGEST, RUNAWAY, SOUND
from .liquid import Liquid
from .neighbours import vec3
from .settled import Packing

GRAVITY = 9.81
TOP_SPEED = 20.0  # m/s, ten times what falls from a cup
STRIDE = 512  # Taichi gives each CPU thread at least this many consecutive iterations
SETTLING_LIQUID = Liquid(viscosity=0.05, cohesion=0.0, density=1000.0)
DAMPING = 0.97  # of velocities each substep while a packing settles


@ti.data_oriented
class Fluid(Attraction):
    """State and steps of up to `slots` liquids of at most `particles` each.

    A scene is a subclass that overrides `boundary` and `contain`, and whose kernels run `flow`.
    The first `alive[b]` particles of simulation b take part.
    """

    walls = 0  # that `wall_near` knows

    @ti.func
    def gravity(self, b):
        """Acceleration of free fall [m/s²]."""
        return vec3(0.0, 0.0, -GRAVITY)

    @ti.func
    def contain(self, b):
        """Push positions out of walls, and take the velocity that leads into them."""

    @ti.func
    def wall_near(self, b, i, n: ti.template()):
        """Distance of particle i to wall n < `walls` [m], the wall's inward normal, and its
        share in [0, 1], which fades out where the wall ends."""
        return 1e9, vec3(0.0), 0.0

    @ti.func
    def flow(self, b):
        """One substep."""
        self.search(b)
        for i in range(self.alive[b]):
            self.velocity[b, i] = self.velocity[b, i] + self.dt * self.gravity(b)
        self.measure(b)
        self.couple(b)
        if self.cohesion[b] > 0.0:
            self.attract(b)
        if ti.static(len(self.effects) > 0):
            self.substeps[b] = self.substeps[b] + 1
        for sweep in range(self.numerics.iterations - 1):
            self.project(b, sweep % 2)
        self.shear(b)
        self.project(b, (self.numerics.iterations - 1) % 2)
        self.move(b)
        self.contain(b)

    @ti.func
    def move(self, b):
        """Move the particles, unless one is faster than any liquid here can be."""
        fastest, total = 0.0, 0.0
        for i in range(self.alive[b]):
            squared = self.velocity[b, i].norm_sqr()
            fastest = ti.max(fastest, squared)
            total += squared  # NaN where any is, which a maximum passes over
        if not (fastest < TOP_SPEED * TOP_SPEED and total < LARGEST):
            self.fault[b] = RUNAWAY
        else:
            for i in range(self.alive[b]):
                self.position[b, i] = self.position[b, i] + self.dt * self.velocity[b, i]

    @ti.kernel
    def flow_on(self, active: ti.i32, steps: ti.i32, damping: ti.f32):
        """Substeps of the first `active` liquids, velocities times `damping` after each."""
        for n in range(active * STRIDE):
            if n % STRIDE == 0:
                b = n // STRIDE
                for _n in range(steps):
                    if self.fault[b] == SOUND:
                        self.flow(b)
                    for i in range(self.alive[b]):
                        self.velocity[b, i] = damping * self.velocity[b, i]

    def place(self, positions, multipliers=None):
        """Put particles at rest into the first slots.

        Args:
            positions: For each simulation [n, 3] in m, of any n that fits.
            multipliers: The pressures that held them where they settled, [n] each.
        """
        position = np.zeros((self.slots, self.particles, 3), np.float32)
        multiplier = np.zeros((self.slots, self.particles), np.float32)
        alive = np.zeros(self.slots, np.int32)
        for b, points in enumerate(positions):
            alive[b] = len(points)
            position[b, : len(points)] = points
            if multipliers is not None:
                multiplier[b, : len(points)] = multipliers[b]
        self.position.from_numpy(position)
        self.multiplier.from_numpy(multiplier)
        self.alive.from_numpy(alive)
        self.velocity.fill(0)
        self.fault.fill(0)

    def pour_in(self, liquid, coefficients=None):
        """Set what liquid each slot holds, from a batched `Liquid`, and the coefficients of the
        scene's effects, shape [effects, b]; None: they do not act."""
        self.start_effects(coefficients)
        self.viscosity.from_numpy(self.padded(liquid.viscosity))
        self.cohesion.from_numpy(self.padded(liquid.cohesion))
        density = self.padded(liquid.density)
        density[len(liquid.density) :] = 1.0
        self.density.from_numpy(density)

    def settle(self, active, steps, damping):
        """Let the first `active` packings relax."""
        self.flow_on(active, steps, damping)

    def relax_packing(self, active, seconds):
        """Let the first `active` packings come to rest, the same for every liquid."""
        self.pour_in(SETTLING_LIQUID.batch(active))
        self.settle(active, round(seconds * self.rate), DAMPING)

    def settled(self, positions, seconds):
        """Particles [n, 3] each, come to rest."""
        self.place(positions)
        self.relax_packing(len(positions), seconds)
        position, multiplier = self.position.to_numpy(), self.multiplier.to_numpy()
        return [
            Packing(position[b, : len(points)], multiplier[b, : len(points)])
            for b, points in enumerate(positions)
        ]

    def padded(self, values):
        """`values` [b, ...] as float32 with zeros up to the number of slots."""
        full = np.zeros((self.slots, *values.shape[1:]), np.float32)
        full[: len(values)] = values
        return full
