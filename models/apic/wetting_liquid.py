# type: ignore  (Taichi compiles this source and gives these names their types)
"""Liquids whose surface pulls and that wet walls."""

import taichi as ti

from .gravity import GRAVITY
from .lanes import LANES
from .liquid_state import LiquidState
from .mirror import image, images
from .pressure import push
from .surface import find_liquid, set_up_pressure
from .tension import pull_surface
from .viscosity import solve_viscosity, weigh_stresses


@ti.data_oriented
class WettingLiquid(LiquidState):
    """A scene is a subclass with the function `transfer_out` of a group in a step.

    Attributes:
        tension: Over density [m³/s²].
        cosine: Of the contact angle.
        loose: Squared thickness of films that the wall begins to let go [m²]; 0 if it wets.
        open: 1 where liquid may be, or its image.
        wall: Area of wall that rubs at the face, in cells.
        passage: Open share of the face, or 1 in the mirror.
    """

    UPRIGHT, WETTING = False, True
    LEAST_AT_WALL = 0.02  # what touches a wall cannot leave it without making room for air
    MENDING_TIME = 0.02
    TOLERANCE = 1e-3

    def __init__(self, groups, cells, particles, effects=()):
        """The arguments are those of `LiquidState`."""
        super().__init__(groups, cells, particles, effects)
        self.open = ti.field(ti.f32, cells)
        self.wall, self.passage = (ti.field(ti.f32, (3, cells)) for _ in range(2))
        self.tension, self.cosine, self.loose = (
            ti.Vector.field(LANES, ti.f32, groups) for _ in range(3)
        )

    @ti.kernel
    def enter_surfaces(
        self, usable: ti.types.ndarray(ti.f32, 1), of_faces: ti.types.ndarray(ti.f32, 3)
    ):
        """Take a geometry's `usable`, and its `wall` and `area` as [2, 3, cells]."""
        for m in range(of_faces.shape[2]):
            self.open[m] = usable[m]
            for a in range(3):
                self.wall[a, m] = of_faces[0, a, m]
                self.passage[a, m] = of_faces[1, a, m]
        if ti.static(self.MIRRORED):
            for _ in range(1):
                for n in range(images(self)):
                    m, o = image(self, n)
                    self.open[m] = self.open[o]
                    self.passage[1, o] = 1.0

    @ti.kernel
    def set_surfaces(self, surface: ti.types.ndarray(ti.f32, 3)):
        """Take tensions over densities and cosines of contact angles, [2, groups, LANES]."""
        for g in range(surface.shape[1]):
            for lane in range(LANES):
                self.tension[g][lane] = surface[0, g, lane]
                self.cosine[g][lane] = surface[1, g, lane]
                repelled = ti.max(-surface[1, g, lane], 0.0)
                self.loose[g][lane] = 2.0 * surface[0, g, lane] * repelled / GRAVITY

    @ti.func
    def take_step(self, g, step):
        self.transfer_in(g, step)
        find_liquid(self, g)
        set_up_pressure(self, g)
        pull_surface(self, g)
        push(self, g, self.pressure)
        weigh_stresses(self, g, step)
        solve_viscosity(self, g, step)
        self.project(g)
        self.transfer_out(g, step)
