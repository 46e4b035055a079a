"""The stick alone: a uniform rod that swings from the gripper at rest."""

import numpy as np
from analysis.motion import oscillation
from bolfi_liquids.models.liquid import Liquid
from bolfi_liquids.models.stir_setup import Cup, Stick, StirSetup
from bolfi_liquids.models.stirring import stir
from bolfi_liquids.models.stirs.slip_law import PIVOT_DAMPING
from case import Case, CaseResult, Curve, Panel, Row
from truths.pendulum import period_in_air

from . import _stirring

STICK = Stick(radius=0.005, length=0.15, mass=0.02)
CUP = Cup(radius=0.1, height=0.1, fill=0.02)
DIP = 0.003  # m
EMPTY = {"fill_level": -CUP.fill}  # no particle is left
STARTS = (6.0, 20.0, 35.0)  # deg
SECONDS, RATE = 6.0, 240.0
KEPT_TOLERANCE = 0.01
TOLERANCE = 0.002


def run(seed: int) -> CaseResult:
    """Period of each swing, and how much of its amplitude is left at the end."""
    path = _stirring.resting(STICK.length + CUP.fill - DIP, SECONDS, RATE)
    nothing = Liquid(viscosity=0.0, cohesion=0.0, density=1.0)
    rows, curves, swings = [], [], []
    loss = np.exp(-0.5 * PIVOT_DAMPING / STICK.inertia * SECONDS)
    for number, start in enumerate(STARTS):
        setup = StirSetup(CUP, STICK, DIP, tilt=(np.radians(start), 0.0))
        time, angle = path.time, stir(nothing, path, setup, [seed], EMPTY)[0, :, 0]
        swing = oscillation(time, angle)
        kept = np.exp(-swing.decay * SECONDS)
        # the amplitude halfway, as the swing may die away
        halfway = swing.amplitude * np.exp(-swing.decay * SECONDS / 2)
        degrees = np.degrees(swing.amplitude)
        expected = float(period_in_air(halfway, _stirring.rod(STICK)))
        rows += [
            Row.relative(f"period at {degrees:.0f} deg [s]", expected, swing.period, TOLERANCE),
            Row.relative(f"amplitude left at {degrees:.0f} deg", loss, kept, KEPT_TOLERANCE),
        ]
        curves.append(Curve(f"{degrees:.0f} deg", time, np.degrees(angle), series=number))
        swings.append((np.degrees(halfway), swing.period))
    amplitudes = np.linspace(0.0, 40.0, 50)
    periods = period_in_air(np.radians(amplitudes), _stirring.rod(STICK))
    against = (
        Curve("elliptic integral", amplitudes, periods, truth=True),
        Curve("simulated", *np.transpose(swings)),
    )
    panels = (
        Panel("time [s]", "inclination [deg]", tuple(curves)),
        Panel("amplitude [deg]", "period [s]", against),
    )
    return CaseResult(tuple(rows), panels)


CASE = Case(
    truth="a rigid rod's period by its amplitude, and the pivot's friction as its only loss",
    source="Landau & Lifshitz, Mechanics, section 11",
    unit="relative",
    run=run,
)
