"""Pours by a reference solver, and the table of the liquids that it poured."""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..inputs.cups import open_cups
from ..inputs.pour_table import PourTable, check_scene, open_pours
from ..inputs.table import Table, read_table
from .reference_landings import Landing, landings_file, open_landings
from .truth_columns import NAME, positive, within

if TYPE_CHECKING:
    from ..models import Cups

POUR_TRUTHS, CUPS = "pour_truths.csv", "cups.toml"
FILE, LIQUID, RESOLVED = "file", "liquid", "retained_resolved"
VISCOSITY, DENSITY = "viscosity_Pa_s", "density_kg_m3"
TENSION, ANGLE, HOLD = "surface_tension_N_m", "contact_angle_deg", "hold_s"
COLUMNS = (FILE, LIQUID, VISCOSITY, DENSITY, TENSION, ANGLE, HOLD, RESOLVED)
FIX_HEADER = f"give a column for each of {', '.join(COLUMNS)}"
MAX_TENSION, LONGEST_HOLD = 1.0, 60.0  # N/m; s
STEP = 2.5e-3  # m, between distances
PLACES = 6  # of a distance in m, so that equal ones are the same number
MAX_DISAGREEMENT = 0.05  # of landings with their table; bins are worth .02
YES_NO = {"yes": True, "no": False}


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
        name: Of the liquid and the cup's contact angle.
        liquid: Its name alone.
        table: Name of the file of its pours.
        viscosity: [Pa s].
        density: [kg/m³].
        surface_tension: [N/m].
        cups: With the contact angle and the hold of these pours.
        retained_resolved: Whether the reference resolves the film that stays in the source.
        pours: From the slowest to the fastest.
    """

    name: str
    liquid: str
    table: str
    viscosity: float
    density: float
    surface_tension: float
    cups: "Cups"
    retained_resolved: bool
    pours: tuple[ReferencePour, ...]

    @property
    def angular_velocity(self) -> NDArray[np.float64]:
        """Of each pour [rad/s], shape (pours,)."""
        return np.array([pour.angular_velocity for pour in self.pours])

    @property
    def hash(self) -> str:
        """SHA-256 of the pours, in hexadecimal."""
        values = [np.hstack([one for one in pour if one is not None]) for pour in self.pours]
        return sha256(b"".join(pour.tobytes() for pour in values)).hexdigest()

    @property
    def contact_angle_deg(self) -> float:
        """Of the liquid with the source [deg]."""
        return self.cups.source.contact_angle_deg


def open_poured_liquids(folder: Path) -> tuple[PouredLiquid, ...]:
    """Read all pours of a directory and their truths, so that nothing is found wrong later.

    Args:
        folder: A directory with `POUR_TRUTHS`, `CUPS` and tables of pours; `bolfi-liquids guide
            files` has their columns.

    Returns:
        From the thinnest liquid to the thickest, and from wetting to not.

    Raises:
        InputError: A file cannot be used; the message names file, line, column and value.
    """
    table = read_table(folder / POUR_TRUTHS)
    files, liquids = table.column(FILE, FIX_HEADER), table.column(LIQUID, FIX_HEADER)
    if not len(table.lines):
        raise InputError(
            "holds no liquid", where=str(table.path), fix="write a row for each, and its pours"
        )
    cups, resolved = _cups_of_rows(table, open_cups(folder / CUPS)), _yes_no(table, RESOLVED)
    viscosity = positive(table, VISCOSITY, "Pa s", FIX_HEADER)
    density = positive(table, DENSITY, "kg/m³", FIX_HEADER)
    tension = within(table, TENSION, (0.0, MAX_TENSION), "a tension in N/m", FIX_HEADER)
    _check_files(folder, table)
    found: dict[str, PouredLiquid] = {}
    for row, (file, liquid) in enumerate(zip(files, liquids, strict=True)):
        where = table.where(table.lines[row], LIQUID)
        name = _name(liquid, cups[row].source.contact_angle_deg, where)
        if name in found:
            fix = "leave one of the two rows, or give one of the liquids another name"
            raise InputError(f"{liquid!r} has another row of this angle", where=where, fix=fix)
        found[name] = PouredLiquid(
            name=name,
            liquid=liquid,
            table=file,
            viscosity=viscosity[row],
            density=density[row],
            surface_tension=tension[row],
            cups=cups[row],
            retained_resolved=resolved[row],
            pours=_pours(folder / file, liquid, cups[row]),
        )
    return tuple(sorted(found.values(), key=lambda one: (one.viscosity, one.contact_angle_deg)))


def _cups_of_rows(table: Table, cups: "Cups") -> list["Cups"]:
    """The cups as each liquid found them: its contact angle and its hold."""
    angles = within(table, ANGLE, (0.0, 180.0), "an angle of 0 to 180 deg", FIX_HEADER)
    holds = within(table, HOLD, (0.0, LONGEST_HOLD), f"0 to {LONGEST_HOLD:g} s", FIX_HEADER)
    return [
        cups.model_copy(
            update={
                "source": cups.source.model_copy(update={"contact_angle_deg": angle}),
                "pour": cups.pour.model_copy(update={"hold": hold}),
            }
        )
        for angle, hold in zip(angles, holds, strict=True)
    ]


def _yes_no(table: Table, name: str) -> list[bool]:
    cells = table.column(name, FIX_HEADER)
    for cell, line in zip(cells, table.lines, strict=True):
        if cell.lower() not in YES_NO:
            raise InputError(f"got {cell!r}", where=table.where(line, name), fix="give yes or no")
    return [YES_NO[cell.lower()] for cell in cells]


def _check_files(folder: Path, table: Table) -> None:
    """Refuse rows whose pours are not there, and pours of liquids that have no row."""
    named: dict[str, set[str]] = {}
    pairs = zip(table.column(FILE), table.column(LIQUID), table.lines, strict=True)
    for file, liquid, line in pairs:
        if not file or Path(file).name != file or not (folder / file).is_file():
            fix = f"put the table of pours into {folder}, or correct its name"
            raise InputError(f"no table {file!r}", where=table.where(line, FILE), fix=fix)
        named.setdefault(file, set()).add(liquid)
    for file, liquids in named.items():
        poured = set(read_table(folder / file).column(LIQUID))
        if without := sorted(poured - liquids):
            raise InputError(
                f"no row for {', '.join(map(repr, without))} of {file}",
                where=str(table.path),
                fix="add the liquid, or remove its pours",
            )


def _pours(path: Path, liquid: str, cups: "Cups") -> tuple[ReferencePour, ...]:
    """The pours of one liquid in a table, with their landings where these are known."""
    table = open_pours(path, liquid, told=False)
    check_scene(table, cups)
    beside = landings_file(path)
    landed = open_landings(beside) if beside.is_file() else ()
    pours = []
    for rate in np.unique(table.angular_velocity):
        pour, speed = _pour(table, float(rate)), float(np.degrees(rate))
        for one in landed:
            if one.liquid == liquid and np.isclose(one.angular_velocity_deg_s, speed):
                pour = _with_landing(pour, one, cups, f"{beside}: {liquid} at {speed:g} deg/s")
        pours.append(pour)
    return tuple(pours)


def _pour(table: PourTable, rate: float) -> ReferencePour:
    """The pour of one angular velocity [rad/s], at the table's distances."""
    rows = np.flatnonzero(table.angular_velocity == rate)
    rows = rows[np.argsort(table.distance[rows])]
    distance, fractions = table.distance[rows].round(PLACES), table.fractions[rows]
    if (same := np.diff(distance) == 0.0).any():
        twice = 100.0 * distance[int(np.argmax(same))]
        raise InputError(
            f"{table.liquid} at {np.degrees(rate):g} deg/s has two rows of {twice:g} cm",
            where=str(table.path),
            fix="leave one of them",
        )
    return ReferencePour(rate, distance, fractions[:, 0], float(fractions[:, 2].mean()))


def _with_landing(pour: ReferencePour, landing: Landing, cups: "Cups", where: str) -> ReferencePour:
    """The pour at all distances of the decision, which landings tell between the table's rows."""
    radius = cups.receiver.radius
    apart = np.abs(landing.spilled(pour.distance, radius) - pour.spilled)
    if apart.max() > MAX_DISAGREEMENT:
        at = int(np.argmax(apart))
        raise InputError(
            f"at {100.0 * pour.distance[at]:g} cm the landings spill {apart[at]:.2f} more or less "
            "than the table of pours",
            where=where,
            fix="correct one of them; bins are 1 mm along and 2 mm across, named by lower edges",
        )
    low, high = cups.distance_range
    distance = np.linspace(low, high, round((high - low) / STEP) + 1).round(PLACES)
    return pour._replace(
        distance=distance, spilled=landing.spilled(distance, radius), landing=landing.mean
    )


def _name(liquid: str, angle: float, where: str) -> str:
    name = f"{liquid}_contact_{angle:g}".replace(".", "_")
    if not NAME.fullmatch(name):
        raise InputError(
            f"{liquid!r} cannot name results",
            where=where,
            fix="rename the liquid: lower case letters, digits and _, a letter first",
        )
    return name
