"""Recordings of a reference solver, and the table of the liquids that it stirred."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..inputs.open import open_recording
from ..inputs.recording import Recording
from ..inputs.start import above_liquid
from ..inputs.table import MISSING, Table, read_table
from .truth_columns import NAME, positive

TRUTHS = "truths.csv"
FILE, VISCOSITY, FILL, HIDDEN = "file", "viscosity_Pa_s", "true_fill_m", "hidden"
SIZE = "size"  # of what is hidden; a table without it tells no size
FIX_HEADER = f"give a column for each of {FILE}, {VISCOSITY}, {FILL} and {HIDDEN}"


CoefficientOf = Callable[[float, float], float]
"""Of an effect, from the size in a table of truths and the recording's duration [s]."""

HIDDEN_EFFECTS: Mapping[str, tuple[str, CoefficientOf]] = {
    "delay": ("camera_delay", lambda size, seconds: size),
    "pivot": ("pivot_friction", lambda size, seconds: size),
    "mass": ("stick_mass", lambda size, seconds: 1.0 + size),
    "warming": ("warming", lambda size, seconds: float(np.log(size)) / seconds),
    "scale": ("gripper_scale", lambda size, seconds: 1.0 / size),
}
"""What tables call the effects of `models.EFFECTS`. Sizes are s, N m, the fraction by which the
stick is heavier, the factor by which the viscosity falls until the end, and how many times the true
path the written one is."""


MORE_THAN = {"pivot": 0.0, "mass": -1.0, "warming": 0.0, "scale": 0.0}
"""What the sizes of some of them exceed."""


@dataclass(frozen=True, eq=False)
class ReferenceStir:
    """A stir of the reference solver in a liquid that is known.

    Attributes:
        name: Of the recording's file, without its ending.
        recording: What cameras would have recorded of it.
        viscosity: Given to the solver [Pa s].
        fill: Depth of the liquid in the solver [m]; the recording's own is nominal.
        effects: Coefficients of `models.EFFECTS` that the recording does not tell.
    """

    name: str
    recording: Recording
    viscosity: float
    fill: float
    effects: Mapping[str, float] = field(default_factory=dict)

    @property
    def thinnest(self) -> float:
        """Viscosity at the end, if the liquid warms [Pa s]."""
        fallen = self.effects.get("warming", 0.0) * float(np.ptp(self.recording.time))
        return self.viscosity * float(np.exp(-max(fallen, 0.0)))


class ReferenceStirs(NamedTuple):
    """The stirs of a reference.

    Attributes:
        stirs: Those whose hidden effect is known, or that have none, from the thinnest liquid to
            the thickest.
        left_out: Name -> hidden effect of the others.
    """

    stirs: tuple[ReferenceStir, ...]
    left_out: Mapping[str, str]


def open_reference_stirs(folder: Path) -> ReferenceStirs:
    """Read all recordings of a directory and their truths, so that nothing is found wrong later.

    Args:
        folder: A directory of NetCDF files, and truths.csv with a row for each. Its columns are
            `file`, `viscosity_Pa_s`, `true_fill_m`, and `hidden`, an effect that is in the data,
            empty where there is none; and perhaps `size`, the effect's, see `HIDDEN_EFFECTS`.
            Other columns are not read.

    Raises:
        InputError: The table or a recording cannot be used; the message names file, line, column
            and value.
    """
    table = read_table(folder / TRUTHS)
    _check_files(folder, table)
    hidden = [_effect(cell) for cell in table.column(HIDDEN, FIX_HEADER)]
    viscosity = positive(table, VISCOSITY, "Pa s", FIX_HEADER)
    fill = positive(table, FILL, "m", FIX_HEADER)
    sizes = table.numbers(SIZE) if table.has(SIZE) else None
    stirs, left_out = [], {}
    for row, file in enumerate(table.column(FILE)):
        if hidden[row] and (sizes is None or hidden[row] not in HIDDEN_EFFECTS):
            left_out[Path(file).stem] = hidden[row]
            continue
        recording = open_recording(folder / file)
        effects = _effects(table, row, hidden[row], sizes, float(np.ptp(recording.time)))
        stir = ReferenceStir(_name(table, row), recording, viscosity[row], fill[row], effects)
        _check_fill(stir, table.where(table.lines[row], FILL))
        stirs.append(stir)
    if not stirs:
        raise InputError(
            "every recording holds a hidden effect whose size is not known",
            where=f"{table.path}: column {HIDDEN}",
            fix=f"add a recording without one; the cell is then empty; or a column {SIZE}",
        )
    stirs.sort(key=lambda stir: (stir.viscosity, stir.name))
    return ReferenceStirs(tuple(stirs), left_out)


def _check_files(folder: Path, table: Table) -> None:
    """Refuse rows and recordings that are not in pairs."""
    there = {path.name for path in folder.glob("*.nc") if not path.name.startswith(".")}
    lines: dict[str, int] = {}
    for file, line in zip(table.column(FILE, FIX_HEADER), table.lines, strict=True):
        where = table.where(line, FILE)
        if file in lines:
            fix = "leave one of the two rows"
            raise InputError(f"{file!r} is in line {lines[file]}, too", where=where, fix=fix)
        if file not in there:
            fix = f"put the recording into {folder}, correct its name or remove the row"
            raise InputError(f"no recording {file!r}", where=where, fix=fix)
        lines[file] = int(line)
    if without := sorted(there - set(lines)):
        raise InputError(
            f"no row for {', '.join(without)}",
            where=str(table.path),
            fix="add the liquid of each recording, or move the recording elsewhere",
        )
    if not lines:
        raise InputError("holds no recording", where=str(folder), fix="add one, and its row")


def _effect(cell: str) -> str:
    return "" if cell.lower() in MISSING else cell


def _effects(
    table: Table, row: int, hidden: str, sizes: np.ndarray | None, seconds: float
) -> dict[str, float]:
    if not hidden or sizes is None:
        return {}
    name, coefficient = HIDDEN_EFFECTS[hidden]
    size = float(sizes[row])
    if not (np.isfinite(size) and size > MORE_THAN.get(hidden, -np.inf)):
        raise InputError(
            f"got {table.column(SIZE)[row]!r}",
            where=table.where(table.lines[row], SIZE),
            fix=f"give the size of {hidden}, a number it may have",
        )
    return {name: coefficient(size, seconds)}


def _name(table: Table, row: int) -> str:
    name = Path(table.column(FILE)[row]).stem
    if not NAME.fullmatch(name):
        raise InputError(
            f"{name!r} cannot name results",
            where=table.where(table.lines[row], FILE),
            fix="rename the recording: lower case letters, digits and _, a letter first",
        )
    return name


def _check_fill(stir: ReferenceStir, where: str) -> None:
    """Refuse a depth that the cup does not hold, or that the stick does not reach."""
    recording, most = stir.recording, stir.recording.number("cup_height")
    tip = recording.number("fill") + above_liquid(recording)  # above the floor, at the start
    if not tip < stir.fill <= most:
        raise InputError(
            f"{stir.fill:g} m is not between the stick's tip, {tip:g} m above the floor, and the "
            f"cup's rim, {most:g} m",
            where=where,
            fix="give the depth of the liquid in m",
        )
