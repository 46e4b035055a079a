"""Stirring neither makes nor loses volume."""

import numpy as np
from bolfi_liquids.models.frames import stir_frames
from bolfi_liquids.models.liquid import Liquid
from bolfi_liquids.models.stir_setup import StirSetup
from case import Case, CaseResult, Curve, Panel, Row

from . import seed_noise
from ._stirring import Path

SECONDS, REST = 10.0, 3.0  # of stirring, and after it for the surface to become level
VISCOSITY = (0.001, 0.01, 0.1, 1.0, 20.0)
DENSITY = 1000.0
TOLERANCE = 0.01


def strokes_and_rest() -> Path:
    """To and fro for ten seconds, then nothing."""
    path = seed_noise.strokes()
    rate = seed_noise.RATE
    whole = round(SECONDS * rate)
    moving = np.resize(path.position[: round(0.8 * rate)], (whole, 3))  # a stroke is 0.8 s
    start = np.tile(path.position[0], (round(REST * rate), 1))
    position = np.concatenate([moving, start])
    return Path(np.arange(len(position)) / rate, position)


def run(seed: int) -> CaseResult:
    """Mean height of the particles at the end, against that of a full cup."""
    setup = StirSetup(seed_noise.CUP, seed_noise.STICK, seed_noise.SUBMERGED)
    path, heights = strokes_and_rest(), []
    for mu in VISCOSITY:
        frames = stir_frames(Liquid(mu, 0.0, DENSITY), path, setup, seed, rate=1.0)
        heights.append(float(frames.position[-1, :, 2].mean()))
    # the line that a stick is to the liquid displaces none of it
    expected = 0.5 * setup.cup.fill
    rows = [
        Row.relative(f"mean height at {mu:g} Pa s [m]", expected, height, TOLERANCE)
        for mu, height in zip(VISCOSITY, heights, strict=True)
    ]
    curves = [
        Curve("full cup", VISCOSITY, np.full(len(VISCOSITY), expected), truth=True),
        Curve("after ten seconds of stirring", VISCOSITY, heights),
    ]
    panel = Panel("viscosity [Pa s]", "mean height of the liquid [m]", tuple(curves), log="x")
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    truth="the volume that was filled in",
    source="incompressibility; particles that stand still fill the cup to its mark",
    unit="relative",
    run=run,
)
