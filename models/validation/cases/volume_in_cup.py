"""Stirring neither makes nor loses volume."""

import numpy as np

from ...fluid import runtime
from ...fluid.liquid import Liquid
from ...fluid.numerics import ParticleNumerics
from ...particle_stirring import _scene
from ...stir_setup import StirSetup
from ...stirring import stir
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from . import seed_noise
from ._stirring import Path

SECONDS, REST = 10.0, 3.0  # of stirring, and after it for the surface to become level
VISCOSITY, COHESION = (0.003, 0.1, 20.0), (0.0, 1.0)
DENSITY = 1000.0
TOLERANCE = 0.03


def strokes_and_rest() -> Path:
    """To and fro for ten seconds, then nothing."""
    path = seed_noise.strokes()
    rate = seed_noise.RATE
    whole = round(SECONDS * rate)
    moving = np.resize(path.position[: round(0.8 * rate)], (whole, 3))  # a stroke is 0.8 s
    start = np.tile(path.position[0], (round(REST * rate), 1))
    position = np.concatenate([moving, start])
    return Path(np.arange(len(position)) / rate, position)


def run(progress: Progress, seed: int) -> CaseResult:
    """Mean height of the particles at the end, against that of a full cup."""
    setup = StirSetup(
        seed_noise.CUP, seed_noise.STICK, seed_noise.SUBMERGED, numerics=ParticleNumerics()
    )
    path = strokes_and_rest()
    mu, cohesion = (np.ravel(grid) for grid in np.meshgrid(VISCOSITY, COHESION))
    stir(Liquid(mu, cohesion, DENSITY), path, setup, np.full(len(mu), seed))
    with runtime.LOCK:
        height = _scene(setup, ()).position.to_numpy()[: len(mu), :, 2].mean(axis=1)
    progress(1.0)
    # of liquid around a stick that reaches to `tip` above the floor
    cup, stick = setup.cup, setup.stick
    tip = cup.fill - setup.submerged
    full, hole = np.pi * cup.radius**2, np.pi * stick.radius**2
    moment = 0.5 * (full * cup.fill**2 - hole * (cup.fill**2 - tip**2))
    expected = moment / setup.liquid_volume(cup.fill)
    rows = [
        Row.relative(f"mean height at {m:g} Pa s, cohesion {c:g} [m]", expected, h, TOLERANCE)
        for m, c, h in zip(mu, cohesion, height, strict=True)
    ]
    curves = [Curve("full cup", VISCOSITY, np.full(len(VISCOSITY), expected), truth=True)]
    curves += [
        Curve(f"cohesion {c:g}", VISCOSITY, height[cohesion == c], series=k)
        for k, c in enumerate(COHESION)
    ]
    panel = Panel("viscosity [Pa s]", "mean height of the liquid [m]", tuple(curves), log="x")
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    name="volume_in_cup",
    title="Volume of a liquid that was stirred",
    truth="the volume that was filled in",
    source="incompressibility; particles that stand still fill the cup to its mark",
    unit="relative",
    tolerance=TOLERANCE,
    settings={
        "viscosity": VISCOSITY,
        "cohesion": COHESION,
        "seconds": (SECONDS, REST),
        "particles": 1000,
    },
    run=run,
)
