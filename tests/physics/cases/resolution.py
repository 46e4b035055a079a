"""The inclination that smaller cells give."""

import numpy as np
from bolfi_liquids.models.liquid import Liquid
from bolfi_liquids.models.numerics import Numerics
from bolfi_liquids.models.stir_setup import StirSetup
from bolfi_liquids.models.stirring import stir
from case import Case, CaseResult, Curve, Panel, Row

from . import seed_noise

VISCOSITY = (0.03, 0.3, 1.0, 5.0)
DENSITY = 1000.0
CELLS = (0.005, 0.0036)  # m
SEEDS = 4
BEGIN = 1.0  # s, of the first stroke
TOLERANCE = 0.25  # deg


def run(seed: int) -> CaseResult:
    """Mean size of the inclination along the strokes, the mean over packings."""
    path, rows, curves, seeds = seed_noise.strokes(), [], [], seed * SEEDS + np.arange(SEEDS)
    for number, viscosity in enumerate(VISCOSITY):
        liquid, seen = Liquid(viscosity, 0.0, DENSITY), []
        for cell in CELLS:
            numerics = Numerics(cell=cell)
            setup = StirSetup(
                seed_noise.CUP, seed_noise.STICK, seed_noise.SUBMERGED, numerics=numerics
            )
            seen.append(np.degrees(stir(liquid, path, setup, seeds)[..., 0]))
        late = path.time > BEGIN
        coarse, fine = (float(np.abs(angle[:, late]).mean()) for angle in seen)
        name = f"mean inclination at {viscosity:g} Pa s [deg]"
        rows.append(Row.absolute(name, fine, coarse, TOLERANCE))
        curves += [
            Curve(f"{viscosity:g} Pa s", path.time, seen[1].mean(axis=0), True, number),
            Curve("", path.time, seen[0].mean(axis=0), series=number),
        ]
    panel = Panel("time [s]", "inclination [deg]", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    truth="the inclination does not depend on the size of cells",
    source="the same stir in smaller cells",
    unit="deg",
    run=run,
)
