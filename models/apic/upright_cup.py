# type: ignore  (Taichi compiles this source and gives these names their types)
"""Liquids in upright cups: what acts on their particles, and what keeps these inside."""

import taichi as ti

from .filling import OFF_WALL
from .lanes import vec3
from .liquid_state import LiquidState


@ti.data_oriented
class UprightCups(LiquidState):
    """A scene is a subclass with the function `acceleration` of a particle.

    Attributes:
        cup_radius: Inside [m].
    """

    def __init__(self, groups, cells, particles, effects=()):
        """The arguments are those of `LiquidState`."""
        super().__init__(groups, cells, particles, effects)
        self.cup_radius = ti.field(ti.f32, ())

    @ti.func
    def accelerate(self, g, lane, n):
        """Change a particle's velocity by what acts on all liquid."""
        pull = self.acceleration(g, lane, self.position[g, lane, n])
        self.speed[g, lane, n] = self.speed[g, lane, n] + self.dt[None] * pull

    @ti.func
    def keep_inside(self, x, v):
        """A particle within the cup, and its velocity without what leads out."""
        off = OFF_WALL * self.cell[None]
        most = self.cup_radius[None] - off
        out = ti.sqrt(x[0] ** 2 + x[1] ** 2)
        if out > most:
            n = vec3(x[0], x[1], 0.0) / out
            x -= (out - most) * n
            v -= ti.max(v.dot(n), 0.0) * n
        if x[2] < off:
            x[2] = off
            v[2] = ti.max(v[2], 0.0)
        top = self.origin[None][2] + (self.shape[None][2] - 1.02) * self.cell[None]
        if x[2] > top:
            x[2] = top
            v[2] = ti.min(v[2], 0.0)
        return x, v
