"""How far the initial packing alone moves the stick."""

import numpy as np
from bolfi_liquids.models.liquid import Liquid
from bolfi_liquids.models.stir_setup import Cup, Stick, StirSetup
from bolfi_liquids.models.stirring import stir
from case import Case, CaseResult, Curve, Panel, Row

from ._stirring import Path

STICK = Stick(radius=0.0045, length=0.22, mass=1200.0 * np.pi * 0.0045**2 * 0.22)
CUP = Cup(radius=0.04, height=0.075, fill=0.05)
SUBMERGED = 0.04  # m
VISCOSITY = (0.001, 0.01, 0.1, 1.0)
DENSITY = 1000.0
STROKE, SPEED = 0.02, 0.1  # m, m/s
SECONDS, RATE = 6.0, 30.0
SEEDS = 6
TOLERANCE = 0.1  # deg, a tenth of what a factor of ten in viscosity does to the signal


def strokes() -> Path:
    """To and fro along x at constant speed, from the cup's axis on."""
    time = np.arange(round(SECONDS * RATE) + 1) / RATE
    phase = (SPEED * time / STROKE + 1.0) % 4.0
    x = STROKE * (1.0 - np.abs(phase - 2.0))
    height = STICK.length - SUBMERGED + CUP.fill
    return Path(time, np.column_stack([x, np.zeros_like(x), np.full_like(x, height)]))


def spread(signals: np.ndarray) -> float:
    """Standard deviation over runs [B, T, 2], RMS over time and planes, in the signals' unit."""
    return float(np.sqrt(np.mean(np.var(signals, axis=0, ddof=1))))


def run(seed: int) -> CaseResult:
    """The same stir from several packings."""
    setup, path = StirSetup(CUP, STICK, SUBMERGED), strokes()
    rows, curves = [], []
    for number, viscosity in enumerate(VISCOSITY):
        liquid = Liquid(viscosity, 0.0, DENSITY)
        signals = np.degrees(stir(liquid, path, setup, seed * SEEDS + np.arange(SEEDS)))
        name = f"{viscosity:g} Pa s"
        rows.append(Row.absolute(f"spread at {name} [deg]", 0.0, spread(signals), TOLERANCE))
        over_time = np.sqrt(np.mean(np.var(signals, axis=0, ddof=1), axis=-1))
        curves.append(Curve(name, path.time, over_time, series=number))
    panel = Panel("time [s]", "standard deviation over packings [deg]", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    truth="a liquid has no memory of how it was poured in",
    source="the same inputs with other seeds",
    unit="deg",
    run=run,
)
