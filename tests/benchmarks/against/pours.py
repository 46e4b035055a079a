"""Pours by a reference solver, and the table of the liquids that it poured."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from bolfi_liquids.models import Cups
from numpy.typing import NDArray
from pydantic import BaseModel, Field, PositiveFloat

from bolfi_liquids.inputs.cups import open_cups
from bolfi_liquids.inputs.pour_table import PourTable, check_scene, open_pours
from bolfi_liquids.inputs.table import read_table

from .landings import Landing, open_landings
from .truths import read_truths

POUR_TRUTHS, CUPS = "pour_truths.csv", "cups.toml"
STEP = 2.5e-3  # m, between distances
PLACES = 6  # of a distance in m, so that equal ones are the same number
MAX_DISAGREEMENT = 0.05  # of landings with their table; bins are worth .02


class PourTruth(BaseModel):
    """A row of `POUR_TRUTHS`; `retained_resolved` is yes or no."""

    file: str
    liquid: str
    viscosity_Pa_s: PositiveFloat
    density_kg_m3: PositiveFloat
    surface_tension_N_m: Annotated[float, Field(ge=0.0, le=1.0)]
    contact_angle_deg: Annotated[float, Field(ge=0.0, le=180.0)]
    hold_s: Annotated[float, Field(ge=0.0, le=60.0)]
    retained_resolved: bool


class ReferencePour(NamedTuple):
    """One pour, into receivers at several distances.

    Attributes:
        angular_velocity: Of the source [rad/s].
        distance: From its lip to the receivers' axes [m], shape (D,), ascending: all of the
            decision where landings are known, else those of the table.
        spilled: Fraction beside each receiver, shape (D,).
        retained: Fraction left in the source.
        landing: Where the liquid lands on average, from the lip [m]; None if nobody wrote it down.
    """

    angular_velocity: float
    distance: NDArray[np.float64]
    spilled: NDArray[np.float64]
    retained: float
    landing: float | None = None


@dataclass(frozen=True, eq=False)
class PouredLiquid:
    """A liquid that is known, and its pours from one cup.

    Attributes:
        liquid: Its name.
        table: Name of the file of its pours.
        viscosity: [Pa s].
        density: [kg/m³].
        surface_tension: [N/m].
        cups: With the contact angle and the hold of these pours.
        retained_resolved: Whether the reference resolves the film that stays in the source.
        pours: From the slowest to the fastest.
    """

    liquid: str
    table: str
    viscosity: float
    density: float
    surface_tension: float
    cups: Cups
    retained_resolved: bool
    pours: tuple[ReferencePour, ...]

    @property
    def name(self) -> str:
        """Of the liquid and the cup's contact angle."""
        return f"{self.liquid}_contact_{self.contact_angle_deg:g}".replace(".", "_")

    @property
    def angular_velocity(self) -> NDArray[np.float64]:
        """Of each pour [rad/s], shape (pours,)."""
        return np.array([pour.angular_velocity for pour in self.pours])

    @property
    def contact_angle_deg(self) -> float:
        """Of the liquid with the source [deg]."""
        return self.cups.source.contact_angle_deg


def open_poured_liquids(folder: Path) -> tuple[PouredLiquid, ...]:
    """Read all pours of a directory and their truths.

    Args:
        folder: A directory with `POUR_TRUTHS`, `CUPS` and tables of pours.

    Returns:
        From the thinnest liquid to the thickest, and from wetting to not.

    Raises:
        ValueError: A file cannot be used.
    """
    truths, cups = read_truths(folder / POUR_TRUTHS, PourTruth), open_cups(folder / CUPS)
    for file in {truth.file for truth in truths}:
        known = {truth.liquid for truth in truths if truth.file == file}
        if unknown := set(read_table(folder / file).column("liquid")) - known:
            raise ValueError(f"{folder / POUR_TRUTHS} has no row for {unknown} of {file}")
    liquids = [_poured_liquid(folder, truth, cups) for truth in truths]
    names = [one.name for one in liquids]
    if len(set(names)) < len(names):
        raise ValueError(f"{folder / POUR_TRUTHS} has two rows of a liquid and angle: {names}")
    return tuple(sorted(liquids, key=lambda one: (one.viscosity, one.contact_angle_deg)))


def _poured_liquid(folder: Path, truth: PourTruth, cups: Cups) -> PouredLiquid:
    """A liquid from the cups as it found them: its contact angle and its hold."""
    source = cups.source.model_copy(update={"contact_angle_deg": truth.contact_angle_deg})
    pour = cups.pour.model_copy(update={"hold": truth.hold_s})
    cups = cups.model_copy(update={"source": source, "pour": pour})
    return PouredLiquid(
        liquid=truth.liquid,
        table=truth.file,
        viscosity=truth.viscosity_Pa_s,
        density=truth.density_kg_m3,
        surface_tension=truth.surface_tension_N_m,
        cups=cups,
        retained_resolved=truth.retained_resolved,
        pours=_pours(folder / truth.file, truth.liquid, cups),
    )


def _pours(path: Path, liquid: str, cups: Cups) -> tuple[ReferencePour, ...]:
    """The pours of one liquid in a table, with their landings where these are known."""
    table = open_pours(path, liquid)
    check_scene(table, cups)
    landed = open_landings(path)
    pours = []
    for rate in np.unique(table.angular_velocity):
        pour, speed = _pour(table, float(rate)), float(np.degrees(rate))
        for one in landed:
            if one.liquid == liquid and np.isclose(one.angular_velocity_deg_s, speed):
                pour = _with_landing(pour, one, cups)
        pours.append(pour)
    return tuple(pours)


def _pour(table: PourTable, rate: float) -> ReferencePour:
    """The pour of one angular velocity [rad/s], at the table's distances."""
    rows = np.flatnonzero(table.angular_velocity == rate)
    rows = rows[np.argsort(table.distance[rows])]
    distance, fractions = table.distance[rows].round(PLACES), table.fractions[rows]
    if (np.diff(distance) == 0.0).any():
        speed = np.degrees(rate)
        raise ValueError(f"{table.path}: two rows of {table.liquid} at {speed:g} deg/s are alike")
    return ReferencePour(rate, distance, fractions[:, 0], float(fractions[:, 2].mean()))


def _with_landing(pour: ReferencePour, landing: Landing, cups: Cups) -> ReferencePour:
    """The pour at all distances of the decision, which landings tell between the table's rows."""
    radius = cups.receiver.radius
    apart = np.abs(landing.spilled(pour.distance, radius) - pour.spilled).max()
    if apart > MAX_DISAGREEMENT:
        raise ValueError(
            f"landings of {landing.liquid} at {landing.angular_velocity_deg_s:g} deg/s spill "
            f"{apart:.2f} more or less than the table of pours; bins are 1 mm along and 2 mm "
            "across, named by lower edges"
        )
    low, high = cups.distance_range
    distance = np.linspace(low, high, round((high - low) / STEP) + 1).round(PLACES)
    return pour._replace(
        distance=distance, spilled=landing.spilled(distance, radius), landing=landing.mean
    )
