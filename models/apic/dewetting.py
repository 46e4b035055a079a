# type: ignore  (Taichi compiles this source and gives these names their types)
"""Films that walls do not hold, as the liquid does not wet them.

On a wall that a liquid meets at an angle a beyond 90 degrees, each area that it covers costs
-sigma cos a. So a thin film draws back and gathers until its weight spreads it no further. Where a
film of thickness e covers a share s of a level wall, it is e / s thick and has the energy
rho g e^2 / (2 s) - s sigma cos a, which is least at s^2 = rho g e^2 / (-2 sigma cos a). The
thickness of a puddle is found so, too (de Gennes, Brochard-Wyart and Quere 2004, "Capillarity and
wetting phenomena", chapter 2); the tension of the film's own surface is left out here, as it acts
on the grid.

Under the same weight what is 1 / s times as thick flows 1 / s^2 times as fast (Nusselt 1916). So
walls rub by s^2, and edges draw back at a speed of order sigma a^3 / mu (Redon, Brochard-Wyart and
Rondelez 1991, "Dynamics of dewetting"). Walls that are met at 90 degrees or less hold any film:
nothing drives it off before it has holes.
"""

import taichi as ti

from .lanes import lanes


@ti.func
def wall_hold(s, g, a, m):
    """Share of its friction that the wall at a face has, by how full the liquid leaves the cell
    before it; thicker films are resolved."""
    full = s.mass[g, a, m] / ti.max(1.0 - s.solid[a, m], 1e-6)
    least = ti.min(s.loose[g] / s.cell[None] ** 2, 1.0)
    return ti.select(least > 0.0, ti.min(full * full / ti.max(least, 1e-12), 1.0), lanes(1.0))
