"""Pours of a reference, repeated by the simulator in the same liquid: what is judged of each."""

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..models import Cups, Landings, Liquid, landings
from ..models.liquid import TENSION_AT_ONE
from ..models.pours.resolution import PER_CELL
from ..models.validation import Case, CaseResult, Curve, Panel, Progress, Row
from .pour_bars import (
    JUDGED_SPILLAGE,
    MAX_EXCESS,
    MAX_LANDING_ERROR,
    MAX_RETAINED_ERROR,
    MAX_RMS,
)
from .reference_pours import PouredLiquid, ReferencePour

RMS = "RMS of the spilled fraction, mean over speeds"
LANDING = "landing off by, mean over speeds [mm]"
RETAINED = "retained off by, mean over speeds"
EXCESS = "spilled beyond the least, at most"
REFERENCE, SIMULATED = "reference", "simulated"  # curves of a plot

Simulate = Callable[[PouredLiquid, NDArray[np.int64], float | None], Landings]
"""(liquid and its B pours, seeds [B], cell [m]) -> where the pours land."""


def repeated(
    reference: PouredLiquid, seeds: NDArray[np.int64], cell: float | None = None
) -> Landings:
    """The pours in the reference's own liquid, side by side; see `Simulate`."""
    cohesion = reference.surface_tension / TENSION_AT_ONE
    liquid = Liquid(reference.viscosity, cohesion, reference.density)
    fineness = _fineness(reference.cups, cell)
    return landings(liquid, reference.angular_velocity, reference.cups, seeds, **fineness)


def _fineness(cups: Cups, cell: float | None) -> dict[str, Any]:
    """The simulator's argument for cells of this width [m]; none leaves it its own."""
    return {} if cell is None else {"particles": round(PER_CELL * cups.liquid_volume / cell**3)}


class Repeated(NamedTuple):
    """How one pour was repeated.

    Attributes:
        angular_velocity: Of the source [rad/s].
        distance: As in the reference [m], shape (D,).
        spilled: Simulated fraction at each distance, shape (D,).
        retained: Simulated fraction.
        landing: Simulated mean landing [m].
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
    landing: float
    rms: float | None
    landing_error: float | None
    retained_error: float
    best_distance: float
    excess: float


def compared(pour: ReferencePour, landed: Landings, radius: float) -> Repeated:
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
    return Repeated(
        angular_velocity=pour.angular_velocity,
        distance=pour.distance,
        spilled=spilled,
        retained=retained,
        landing=landing,
        rms=float(np.sqrt(np.mean(off**2))) if off.size else None,
        landing_error=None if pour.landing is None else landing - pour.landing,
        retained_error=retained - pour.retained,
        best_distance=float("nan" if failed else pour.distance[best]),
        excess=float("nan" if failed else pour.spilled[best] - pour.spilled.min()),
    )


def pour_case(
    reference: PouredLiquid, simulate: Simulate = repeated, cell: float | None = None
) -> Case:
    """The comparison of a liquid's pours with their repetition.

    Args:
        reference: The liquid and its pours.
        simulate: What repeats them.
        cell: Width of the simulator's cells [m]; None leaves it its own.
    """
    return Case(
        name=reference.name,
        title=f"{reference.liquid}, {reference.viscosity:g} Pa s, contact angle "
        f"{reference.contact_angle_deg:g} deg",
        truth="the same fractions from the same liquid and cup",
        source="pours of the reference",
        unit="",
        tolerance=MAX_RMS,
        settings=_settings(reference, cell),
        run=PourReplay(reference, simulate, cell),
    )


@dataclass(frozen=True, eq=False)
class PourReplay:
    """Repeats the pours of one liquid and compares, as a `Case` runs."""

    reference: PouredLiquid
    simulate: Simulate
    cell: float | None

    def __call__(self, progress: Progress, seed: int) -> CaseResult:
        """All speeds together; the notes hold each, see `noted`."""
        pours = self.reference.pours
        seeds = np.full(len(pours), seed)
        fastest = replace(self.reference, pours=pours[-1:])  # compiles what the timed ones run
        self.simulate(fastest, seeds[:1] + 1, self.cell)  # with a seed that they do not share
        began = time.process_time()
        landed = self.simulate(self.reference, seeds, self.cell)
        seconds = time.process_time() - began
        radius = self.reference.cups.receiver.radius
        repeats = [
            compared(pour, Landings(landed.position[k : k + 1], landed.retained[k : k + 1]), radius)
            for k, pour in enumerate(pours)
        ]
        progress(1.0)
        notes = {
            "cpu_s": round(seconds / len(pours), 3),
            "pours": [noted(one) for one in repeats],
        }
        rows = judged_rows(repeats, self.reference.retained_resolved)
        panels = [_panel(*pair) for pair in zip(pours, repeats, strict=True)]
        return CaseResult(rows, tuple(panels), notes)


def judged_rows(repeats: Iterable[Repeated], retained_resolved: bool) -> tuple[Row, ...]:
    """The bars of one liquid. What the reference does not tell has no row.

    Args:
        repeats: Its pours.
        retained_resolved: Whether the reference resolves the film that stays in the source.
    """
    repeats = tuple(repeats)
    rms = [one.rms for one in repeats if one.rms is not None]
    off = [abs(one.landing_error) for one in repeats if one.landing_error is not None]
    retained = [abs(one.retained_error) for one in repeats] if retained_resolved else []
    rows = (
        (RMS, np.mean, rms, MAX_RMS),
        (LANDING, np.mean, 1e3 * np.array(off), 1e3 * MAX_LANDING_ERROR),
        (RETAINED, np.mean, retained, MAX_RETAINED_ERROR),
        (EXCESS, np.max, [one.excess for one in repeats], MAX_EXCESS),
    )
    return tuple(
        Row.absolute(quantity, 0.0, float(summary(values)), bar)
        for quantity, summary, values, bar in rows
        if len(values)
    )


def noted(one: Repeated) -> dict[str, Any]:
    """As plain numbers, in the units of the tables of pours."""
    error = one.landing_error
    return {
        "angular_velocity_deg_s": round(float(np.degrees(one.angular_velocity)), 6),
        "rms": one.rms,
        "landing_mm": 1e3 * one.landing,
        "landing_error_mm": None if error is None else 1e3 * error,
        "retained": one.retained,
        "retained_error": one.retained_error,
        "best_distance_cm": 100.0 * one.best_distance,
        "excess": one.excess,
        "distance_cm": 100.0 * one.distance,
        "spilled": one.spilled,
    }


def _settings(reference: PouredLiquid, cell: float | None) -> Mapping[str, Any]:
    """All that decides the result besides the seed."""
    return {
        "pours": reference.hash,
        "viscosity": reference.viscosity,
        "density": reference.density,
        "surface_tension": reference.surface_tension,
        "retained_resolved": reference.retained_resolved,
        "cups": reference.cups.settings(**_fineness(reference.cups, cell)),
        "judged_spillage": JUDGED_SPILLAGE,
        "max_landing_error_mm": 1e3 * MAX_LANDING_ERROR,
        "max_retained_error": MAX_RETAINED_ERROR,
        "max_excess": MAX_EXCESS,
    }


def _panel(pour: ReferencePour, one: Repeated) -> Panel:
    speed = f"{np.degrees(pour.angular_velocity):g} deg/s"
    return Panel(
        f"distance [cm] at {speed}",
        "spilled fraction",
        (
            Curve(REFERENCE, 100.0 * pour.distance, pour.spilled, truth=True),
            Curve(SIMULATED, 100.0 * pour.distance, one.spilled),
        ),
    )
