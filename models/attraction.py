# type: ignore  (Taichi compiles this source and gives these names their types)
"""Cohesion: attraction between particles at free surfaces, damped along the pair.

It acts at surfaces only, since in the bulk it does nothing but heat. Its strength follows the
particles, not the liquid: with particles of millimetres capillarity is below the resolution.
"""

import taichi as ti

from .neighbours import vec3
from .viscous import Viscous

SURFACE_NORMAL = 0.4  # |n| below this is the inside of the liquid
NEAREST = 0.45  # of h, about a spacing: where attraction ends and repulsion begins
DAMPED = 0.3  # of critical damping, along the pair


@ti.data_oriented
class Attraction(Viscous):
    """Pairwise attraction of the particles that lie at a free surface."""

    def __init__(self, slots, particles, spacing, numerics, extent, period=(0.0, 0.0)):
        super().__init__(slots, particles, spacing, numerics, extent, period)
        self.surface = ti.field(ti.f32, (slots, particles))

    @ti.func
    def find_surface(self, b):
        """Share in [0, 1] of each particle in the surface: the sum of its gradients is large
        there, or its density small."""
        for i in range(self.alive[b]):
            n = self.pull[b, i] + self.wall[b, i] + self.body_wall[b, i]
            bend = (self.h * n.norm() - SURFACE_NORMAL) / SURFACE_NORMAL
            sparse = (-self.constraint[b, i] - 0.05) / 0.3
            self.surface[b, i] = ti.math.clamp(ti.max(bend, sparse), 0.0, 1.0)

    @ti.func
    def profile(self, r):
        """Attraction at r = distance / h, at most 1; repulsion closer than a spacing."""
        t = ti.max(1.0 - r, 0.0)
        return 24.0 * (r - NEAREST) * t * t

    @ti.func
    def attract(self, b):
        """Attraction on velocities, and its damping as part of the viscous coupling."""
        self.find_surface(b)
        strength = self.cohesion[b] * self.numerics.attraction
        for i in range(self.alive[b]):
            p = self.position[b, i]
            kick = vec3(0.0)
            for k in range(self.pair_start[b, i], self.pair_start[b, i + 1]):
                j = self.pair_other[b, k]
                weight = 0.5 * strength * (self.surface[b, i] + self.surface[b, j])
                if weight > 0.0:
                    d = self.apart(p, self.position[b, j])
                    distance = ti.max(d.norm(), 1e-3 * self.h)
                    r = distance / self.h
                    t = ti.max(1.0 - r, 0.0)
                    kick -= (self.dt * weight * self.profile(r) / distance) * d
                    damping = DAMPED * ti.sqrt(2.0 * weight / self.h) * 64.0 * (r * t) ** 3
                    g = self.gradient(b, k)
                    self.pair_coupling[b, k] = self.pair_coupling[b, k] + (
                        self.dt * damping / ti.max(g.dot(g), 1e-6)
                    )
            self.velocity[b, i] = self.velocity[b, i] + kick
