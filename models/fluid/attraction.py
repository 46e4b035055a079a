# type: ignore  (Taichi compiles this source and gives these names their types)
"""Cohesion: a tension between neighbours that holds a liquid together and rounds its surfaces.

With n the sum of a particle's density gradients, times h and its walls' included, and m the same
limited in length, pairs exchange momentum along their line of centres e in two ways:

- an attraction along the density's own gradient, a pressure that may fall below zero down to a
  limit. The density is constant wherever there is liquid, so this favours no arrangement of the
  particles; with attractions of other shapes, or repulsion at short range, bodies froze.
- rounding, (1 - r/h)³ e·(m_i - m_j), which levels differences between the normals of neighbours
  in a surface. It is the curvature force of Akinci et al. 2013 ("Versatile surface tension and
  adhesion for SPH fluids", eq. 3), of which the part across e is left out since it turns bodies.

Both keep linear and angular momentum. Walls do not attract, so liquids do not wet them by this.
The strength of cohesion follows the particles, not the liquid: its tension grows with density and
spacing², and is about 0.06 N/m at cohesion 1 with water's density and particles 6 mm apart. With
so much rounding that drops swing at the right frequency, streams part into smaller ones.
"""

import taichi as ti

from .neighbours import vec3
from .viscous import Viscous

ROUNDING = 8.0  # of the attraction; with half as much again streams hold together no better
LONGEST = 0.4  # m is no longer; |n| inside the liquid is less, at a flat surface about 0.8


@ti.data_oriented
class Attraction(Viscous):
    """Tension of the particles' surroundings, in proportion to the liquid's cohesion."""

    def __init__(self, slots, particles, spacing, numerics, extent, period=(0.0, 0.0)):
        super().__init__(slots, particles, spacing, numerics, extent, period)
        self.normal = ti.Vector.field(3, ti.f32, (slots, particles))
        # its product with pair_viscous and both gradients is (1 - r/h)³ e e^T
        self.unit_normal = self.h**2 / (20.0 * self.norm * self.volume)

    @ti.func
    def attract(self, b):
        """Impulses of cohesion in one substep."""
        attraction = self.cohesion[b] * self.numerics.attraction
        self.contract(b, attraction, ROUNDING * attraction)

    @ti.func
    def contract(self, b, attraction, rounding):
        """Impulses of one substep by attraction and rounding of these strengths [m/s²]."""
        unit = self.dt * rounding * self.unit_normal
        for i in range(self.alive[b]):
            n = self.h * (self.pull[b, i] + self.wall[b, i] + self.body_wall[b, i])
            self.normal[b, i] = unit / ti.sqrt(1.0 + n.dot(n) / LONGEST**2) * n
        for i in range(self.alive[b]):
            m = self.normal[b, i]
            even, odd = vec3(0.0), vec3(0.0)
            k, stop = self.pair_start[b, i], self.pair_start[b, i + 1]
            while k + 1 < stop:  # two sums, as in `apply`
                even += self.levelled(b, k, m)
                odd += self.levelled(b, k + 1, m)
                k += 2
            if k < stop:
                even += self.levelled(b, k, m)
            inwards = (self.dt * attraction * self.h) * self.pull[b, i]
            self.velocity[b, i] = self.velocity[b, i] + inwards - even - odd

    @ti.func
    def levelled(self, b, k, m):
        """What pair k levels of the normals at a particle of normal m."""
        g = self.gradient(b, k)
        other = self.normal[b, self.pair_other[b, k]]
        return (self.pair_viscous[b, k] * (m - other).dot(g)) * g
