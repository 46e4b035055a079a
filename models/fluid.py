# type: ignore  (Taichi compiles this source and gives these names their types)
"""A batch of particle liquids: one substep of incompressible, viscous, cohesive flow.

Kernel sums are those of smoothed particle hydrodynamics with the Wendland C2 kernel; walls are
tables (`tables`). One thread runs one simulation from end to end, in a fixed order, so a
simulation's bits depend neither on the batch nor on the number of threads.
"""

import numpy as np
import taichi as ti

from .attraction import Attraction
from .liquid import Liquid
from .neighbours import vec3

GRAVITY = 9.81
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
    def act(self, b):
        """Forces of the effects, and their time."""
        for n in ti.static(range(len(self.force_hooks))):
            at = ti.static(self.force_at[n])
            if self.acts[at, b] == 1:
                self.force_hooks[n](self, b, self.coefficient[at, b])
        self.substeps[b] = self.substeps[b] + 1

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
            self.act(b)
        for sweep in range(self.numerics.iterations - 1):
            self.project(b, sweep % 2)
        self.shear(b)
        self.project(b, (self.numerics.iterations - 1) % 2)
        for i in range(self.alive[b]):
            self.position[b, i] = self.position[b, i] + self.dt * self.velocity[b, i]
        self.contain(b)

    @ti.kernel
    def settle(self, active: ti.i32, steps: ti.i32, damping: ti.f32):
        """Let the first `active` packings relax, velocities times `damping` each substep."""
        for n in range(active * STRIDE):
            if n % STRIDE == 0:
                b = n // STRIDE
                for _n in range(steps):
                    self.flow(b)
                    for i in range(self.alive[b]):
                        self.velocity[b, i] = damping * self.velocity[b, i]

    def place(self, packings):
        """Put `packings`, arrays [particles, 3] of any length that fits, at rest into the slots."""
        positions = np.zeros((self.slots, self.particles, 3), np.float32)
        alive = np.zeros(self.slots, np.int32)
        for b, packing in enumerate(packings):
            alive[b] = len(packing)
            positions[b, : len(packing)] = packing
        self.position.from_numpy(positions)
        self.alive.from_numpy(alive)
        for field in (self.velocity, self.multiplier, self.overflow):
            field.fill(0)

    def pour_in(self, liquid, coefficients=None):
        """Set what liquid each slot holds, from a batched `Liquid`, and the coefficients of the
        scene's effects, shape [effects, b]; None: they do not act."""
        self.start_effects(coefficients)
        self.viscosity.from_numpy(self.padded(liquid.viscosity))
        self.cohesion.from_numpy(self.padded(liquid.cohesion))
        density = self.padded(liquid.density)
        density[len(liquid.density) :] = 1.0
        self.density.from_numpy(density)

    def relax_packing(self, active, seconds):
        """Let the first `active` packings come to rest, the same for every liquid."""
        self.pour_in(SETTLING_LIQUID.batch(active))
        self.settle(active, round(seconds * self.rate), DAMPING)

    def diverged(self, active):
        """Which of the first `active` liquids hold a particle that is nowhere, bool [active]."""
        return ~np.isfinite(self.position.to_numpy()[:active]).all(axis=(1, 2))

    def padded(self, values):
        """`values` [b, ...] as float32 with zeros up to the number of slots."""
        full = np.zeros((self.slots, *values.shape[1:]), np.float32)
        full[: len(values)] = values
        return full
