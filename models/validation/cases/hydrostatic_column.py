"""Liquid at rest on a floor: as dense as it should be, and still."""

import itertools

import numpy as np

from ...fluid.liquid import Liquid
from ..analysis.motion import rms_speed
from ..analysis.shapes import density_by_height
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..scenes.column import Column, at_rest

COLUMN = Column(width=0.052, height=0.078, layers=12)
CORNERS = tuple(itertools.product((0.003, 20.0), (0.0, 1.0)))  # viscosity [Pa s], cohesion
DENSITY = 1000.0
SECONDS = 3.0
SLAB = 2  # spacings, of the plot
TOLERANCE = 0.03
STILL = 0.01  # m/s


def run(progress: Progress, seed: int) -> CaseResult:
    """Density, and the motion that is left, at the corners of a prior."""
    viscosity, cohesion = np.transpose(CORNERS)
    position, velocity = at_rest(COLUMN, Liquid(viscosity, cohesion, DENSITY), SECONDS, seed)
    progress(1.0)
    rows, curves = [], []
    area = COLUMN.block[0] * COLUMN.block[1]
    for number, corner in enumerate(CORNERS):
        name = "{:g} Pa s, cohesion {:g}".format(*corner)
        slabs = density_by_height(position[number], COLUMN.spacing, area, SLAB * COLUMN.spacing)
        whole = slabs.height < COLUMN.height - SLAB * COLUMN.spacing
        density = mean_density(position[number][:, 2])
        speed = float(rms_speed(velocity[number]))
        rows += [
            Row.relative(f"density at {name}", 1.0, density, TOLERANCE),
            Row.absolute(f"speed at {name} [m/s]", 0.0, speed, STILL),
        ]
        curves.append(Curve(name, slabs.height[whole], slabs.density[whole], series=number))
    heights = np.array([0.0, COLUMN.height])
    curves.insert(0, Curve("at rest", heights, np.ones(2), truth=True))
    panel = Panel("height [m]", "density / rest density", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


def mean_density(height: np.ndarray) -> float:
    """Density over that at rest, from the mean height of the particles [m].

    Slabs would cut layers, of which particles at rest have many.
    """
    return 0.5 * COLUMN.height / float(np.mean(height))


CASE = Case(
    name="hydrostatic_column",
    title="Liquid at rest over a floor",
    truth="the density that was asked for, and no motion",
    source="an incompressible liquid in hydrostatic equilibrium",
    unit="relative, m/s",
    tolerance=TOLERANCE,
    settings={
        "corners": CORNERS,
        "layers": COLUMN.layers,
        "height": COLUMN.height,
        "seconds": SECONDS,
    },
    run=run,
)
