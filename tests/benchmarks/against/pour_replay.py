"""Pours of a reference, repeated by the simulator in the same liquid: what is judged of each."""

import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from bolfi_liquids.models import Cups, Landings, Liquid, landings
from bolfi_liquids.models.liquid import TENSION_AT_ONE
from bolfi_liquids.models.pours.resolution import PER_CELL
from case import Curve, Panel, Row
from numpy.typing import NDArray

from .pour_bars import (
    JUDGED_SPILLAGE,
    MAX_EXCESS,
    MAX_LANDING_ERROR,
    MAX_RETAINED_ERROR,
    MAX_RMS,
)
from .pours import PouredLiquid, ReferencePour

RMS = "RMS of the spilled fraction, mean over speeds"
LANDING = "landing off by, mean over speeds [mm]"
RETAINED = "retained off by, mean over speeds"
EXCESS = "spilled beyond the least, at most"
HEAD = " deg/s       RMS  landing, mm  retained  best at, cm  spills more there"

Simulate = Callable[[PouredLiquid, NDArray[np.int64], float | None], Landings]
"""(liquid and its B pours, seeds [B], cell [m]) -> where the pours land."""


class RepeatedPour(NamedTuple):
    """How one pour was repeated.

    Attributes:
        angular_velocity: Of the source [rad/s].
        distance: As in the reference [m], shape (D,).
        spilled: Simulated fraction at each distance, shape (D,).
        retained: Simulated fraction.
        rms: Of the spilled fraction where the reference is judged; None if it nowhere is.
        landing_error: Of the mean landing [m]; None where the reference has none.
        retained_error: Of the retained fraction.
        best_distance: Where the simulation spills least [m].
        excess: What the reference spills there beyond its own least.
    """

    angular_velocity: float
    distance: NDArray[np.float64]
    spilled: NDArray[np.float64]
    retained: float
    rms: float | None
    landing_error: float | None
    retained_error: float
    best_distance: float
    excess: float

    def __str__(self) -> str:
        """A line under `HEAD`: errors are ours less the reference's."""
        rms, landing = (np.nan if one is None else one for one in (self.rms, self.landing_error))
        return (
            f"{np.degrees(self.angular_velocity):6g}{rms:10.3f}{1e3 * landing:13.1f}"
            f"{self.retained_error:10.3f}{100.0 * self.best_distance:13.2f}{self.excess:19.3f}"
        )


class RepeatedPours(NamedTuple):
    """All pours of a liquid, and CPU seconds a pour."""

    pours: tuple[RepeatedPour, ...]
    cpu_s: float


def simulate_pours(
    reference: PouredLiquid, seeds: NDArray[np.int64], cell: float | None = None
) -> Landings:
    """The pours in the reference's own liquid, side by side; see `Simulate`."""
    cohesion = reference.surface_tension / TENSION_AT_ONE
    liquid = Liquid(reference.viscosity, cohesion, reference.density)
    fineness = _fineness(reference.cups, cell)
    return landings(liquid, reference.angular_velocity, reference.cups, seeds, **fineness)


def cell_width(cups: Cups, cell: float | None) -> float:
    """Width of the simulator's cells [m]; its own where `cell` is None."""
    return cups.settings(**_fineness(cups, cell))["numerics"]["cell"]


def _fineness(cups: Cups, cell: float | None) -> dict[str, Any]:
    """The simulator's argument for cells of this width [m]; none leaves it its own."""
    return {} if cell is None else {"particles": round(PER_CELL * cups.liquid_volume / cell**3)}


def repeat_pours(
    reference: PouredLiquid,
    simulate: Simulate = simulate_pours,
    cell: float | None = None,
    seed: int = 0,
) -> RepeatedPours:
    """Repeat all pours of a liquid together, and take the time.

    Args:
        reference: The liquid and its pours.
        simulate: What repeats them.
        cell: Width of the simulator's cells [m]; None leaves it its own.
        seed: Of each pour.
    """
    pours = reference.pours
    seeds = np.full(len(pours), seed)
    fastest = replace(reference, pours=pours[-1:])  # compiles what the timed ones run
    simulate(fastest, seeds[:1] + 1, cell)  # with a seed that they do not share
    began = time.process_time()
    landed = simulate(reference, seeds, cell)
    seconds = time.process_time() - began
    radius = reference.cups.receiver.radius
    repeated = (
        compared(pour, Landings(landed.position[k : k + 1], landed.retained[k : k + 1]), radius)
        for k, pour in enumerate(pours)
    )
    return RepeatedPours(tuple(repeated), round(seconds / len(pours), 3))


def compared(pour: ReferencePour, landed: Landings, radius: float) -> RepeatedPour:
    """A pour of the reference beside its repetition; all NaN where that failed.

    Args:
        pour: Of the reference.
        landed: Of the one pour that repeats it.
        radius: Of the receiver [m].
    """
    spilled = landed.into(pour.distance[:, None], radius).spilled[:, 0]
    retained = float(landed.retained[0])
    ahead = landed.position[0, :, 0]
    fell = ahead[np.isfinite(ahead)]
    landing = float(fell.mean(dtype=np.float64)) if fell.size else float("nan")
    low, high = JUDGED_SPILLAGE
    judged = (pour.spilled >= low) & (pour.spilled <= high)
    off = (spilled - pour.spilled)[judged]
    best = int(np.argmin(spilled))
    failed = np.isnan(retained)
    return RepeatedPour(
        angular_velocity=pour.angular_velocity,
        distance=pour.distance,
        spilled=spilled,
        retained=retained,
        rms=float(np.sqrt(np.mean(off**2))) if off.size else None,
        landing_error=None if pour.landing is None else landing - pour.landing,
        retained_error=retained - pour.retained,
        best_distance=float("nan" if failed else pour.distance[best]),
        excess=float("nan" if failed else pour.spilled[best] - pour.spilled.min()),
    )


def pour_rows(repeated: Iterable[RepeatedPour], retained_resolved: bool) -> tuple[Row, ...]:
    """The bars of one liquid. What the reference does not tell has no row.

    Args:
        repeated: Its pours.
        retained_resolved: Whether the reference resolves the film that stays in the source.
    """
    repeated = tuple(repeated)
    rms = [one.rms for one in repeated if one.rms is not None]
    off = [abs(one.landing_error) for one in repeated if one.landing_error is not None]
    retained = [abs(one.retained_error) for one in repeated] if retained_resolved else []
    rows = (
        (RMS, np.mean, rms, MAX_RMS),
        (LANDING, np.mean, 1e3 * np.array(off), 1e3 * MAX_LANDING_ERROR),
        (RETAINED, np.mean, retained, MAX_RETAINED_ERROR),
        (EXCESS, np.max, [one.excess for one in repeated], MAX_EXCESS),
    )
    return tuple(
        Row.absolute(quantity, 0.0, float(summary(values)), bar)
        for quantity, summary, values, bar in rows
        if len(values)
    )


def pour_panel(pour: ReferencePour, repeated: RepeatedPour) -> Panel:
    """Spilled over distance."""
    return Panel(
        f"distance [cm] at {np.degrees(pour.angular_velocity):g} deg/s",
        "spilled fraction",
        (
            Curve("reference", 100.0 * pour.distance, pour.spilled, truth=True),
            Curve("simulated", 100.0 * pour.distance, repeated.spilled),
        ),
    )
