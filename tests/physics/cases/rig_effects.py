"""What effects in the rig do: to a stick that floats, and to one that swings in air."""

from dataclasses import replace

import numpy as np
from bolfi_liquids.models.liquid import Liquid
from bolfi_liquids.models.stir_setup import StirSetup
from bolfi_liquids.models.stirring import stir
from bolfi_liquids.models.stirs.slip_law import PIVOT_DAMPING
from case import Case, CaseResult, Curve, Panel, Row
from scipy.optimize import root_scalar
from scipy.signal import find_peaks
from truths.pendulum import GRAVITY, floating_angle, period_in_air

from . import _stirring, floating_stick, pendulum_in_air

MASS, DEEPER = 1.1, 0.006  # times the floating stick's mass; m of liquid more
TORQUE = np.array([2e-5, 5e-5, 1e-4])  # N m, in the pivot
START = 20.0  # deg, from which the stick swings in air
FLOAT_TOLERANCE, FRICTION_TOLERANCE = 0.1, 0.03  # deg, of what is lost


def floating(effects: dict[str, float], seed: int) -> float:
    """Angle [deg] at which the stick of the case `floating_stick` comes to rest."""
    stick, cup, rests = floating_stick.STICK, floating_stick.CUP, floating_stick.SECONDS
    surface = stick.length - floating_stick.SUBMERGED
    path = _stirring.resting(surface + cup.fill, rests, floating_stick.RATE)
    tilt = (np.radians(floating_stick.STARTS["below"]), 0.0)
    setup = StirSetup(cup, stick, floating_stick.SUBMERGED, tilt=tilt)
    liquid = Liquid(floating_stick.VISCOSITY, 0.0, floating_stick.DENSITY)
    signal = stir(liquid, path, setup, [seed], effects)[0]
    return float(np.degrees(_stirring.tilt(signal)[path.time > rests - 1.0].mean()))


def float_rows(seed: int) -> list[Row]:
    """A heavier stick, and one in deeper liquid, against Archimedes."""
    stick = floating_stick.STICK
    surface, density = stick.length - floating_stick.SUBMERGED, floating_stick.DENSITY
    heavier = _stirring.rod(replace(stick, mass=MASS * stick.mass))
    truths = {
        "stick_mass": (MASS, floating_angle(heavier, surface, density)),
        "fill_level": (
            DEEPER,
            floating_angle(_stirring.rod(stick), surface - DEEPER, density),
        ),
    }
    return [
        Row.absolute(
            f"angle afloat, {name} {size:g} [deg]",
            float(np.degrees(truth)),
            floating({name: size}, seed),
            FLOAT_TOLERANCE,
        )
        for name, (size, truth) in truths.items()
    ]


def rubbed_peaks(first: float, count: int, torque: float) -> np.ndarray:
    """Sizes of a swing's extremes [rad] from the first on.

    From one side, a, to the other, b, the weight loses what dry friction takes:
    k (cos b - cos a) = τ (a + b). Of what is left, viscous damping c leaves exp(-c T / (4 I)) in
    half a period T.
    """
    stick = pendulum_in_air.STICK
    stiffness = 0.5 * stick.mass * GRAVITY * stick.length
    sizes = [first]
    for _ in range(count - 1):
        a = sizes[-1]

        def missing(b: float, a: float = a) -> float:
            return stiffness * (np.cos(b) - np.cos(a)) - torque * (a + b)

        other = float(root_scalar(missing, bracket=(0.0, a)).root)
        period = float(period_in_air(a, _stirring.rod(stick)))
        sizes.append(other * np.exp(-0.25 * PIVOT_DAMPING * period / stick.inertia))
    return np.array(sizes)


def friction_rows(seed: int) -> tuple[list[Row], Panel]:
    """What dry friction takes from a swing in air."""
    stick, cup, dip = pendulum_in_air.STICK, pendulum_in_air.CUP, pendulum_in_air.DIP
    path = _stirring.resting(stick.length + cup.fill - dip, 4.0, pendulum_in_air.RATE)
    setup = StirSetup(cup, stick, dip, tilt=(np.radians(START), 0.0))
    effects = {**pendulum_in_air.EMPTY, "pivot_friction": TORQUE}
    seeds = np.full(len(TORQUE), seed)
    swings = stir(Liquid(0.0, 0.0, 1.0), path, setup, seeds, effects)[..., 0]
    rows, curves = [], []
    for number, (swing, torque) in enumerate(zip(swings, TORQUE, strict=True)):
        at = find_peaks(np.abs(swing))[0]
        sizes = np.abs(swing[at])
        exact = rubbed_peaks(sizes[0], len(sizes), torque)
        name = f"pivot_friction {torque:g}"
        free = rubbed_peaks(sizes[0], len(sizes), 0.0)[-1]
        what = f"lost by friction in {len(sizes) - 1} halves of a swing over the exact, {name}"
        ours = (free - sizes[-1]) / (free - exact[-1])
        rows.append(Row.absolute(what, 1.0, float(ours), FRICTION_TOLERANCE))
        curves += [
            Curve(name, path.time[at], np.degrees(exact), truth=True, series=number),
            Curve("", path.time[at], np.degrees(sizes), series=number),
        ]
    return rows, Panel("time [s]", "size of the swing [deg]", tuple(curves))


def run(seed: int) -> CaseResult:
    """One effect after the other."""
    afloat = float_rows(seed)
    rubbed, panel = friction_rows(seed)
    return CaseResult((*afloat, *rubbed), (panel,))


CASE = Case(
    truth="Archimedes' angle, and what dry friction takes from the energy of each swing",
    source="Archimedes, On Floating Bodies; Landau & Lifshitz, Mechanics, section 25",
    unit="",
    run=run,
)
