"""Recordings of a reference solver, and the table of the liquids that it stirred."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from bolfi_liquids.inputs.open import open_recording
from bolfi_liquids.inputs.recording import Recording
from bolfi_liquids.inputs.start import above_liquid

from .truths import read_truths

STIR_TRUTHS = "truths.csv"

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


class StirTruth(BaseModel):
    """A row of `STIR_TRUTHS`; `size` is that of what is hidden, see `HIDDEN_EFFECTS`."""

    file: str
    viscosity_Pa_s: PositiveFloat
    true_fill_m: PositiveFloat
    hidden: str = ""
    size: Annotated[float, Field(allow_inf_nan=False)] | None = None


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
    """Read all recordings of a directory and their truths.

    Args:
        folder: A directory of NetCDF files, and `STIR_TRUTHS` with a row for each.

    Raises:
        ValueError: The table or a recording cannot be used.
    """
    truths = read_truths(folder / STIR_TRUTHS, StirTruth)
    files = sorted(path.name for path in folder.glob("*.nc"))
    if files != sorted(truth.file for truth in truths):
        raise ValueError(f"{folder}: {STIR_TRUTHS} must have one row for each of {files}")
    stirs, left_out = [], {}
    for truth in truths:
        if truth.hidden and (truth.size is None or truth.hidden not in HIDDEN_EFFECTS):
            left_out[Path(truth.file).stem] = truth.hidden
        else:
            stirs.append(_stir(folder, truth))
    return ReferenceStirs(tuple(sorted(stirs, key=lambda one: (one.viscosity, one.name))), left_out)


def _stir(folder: Path, truth: StirTruth) -> ReferenceStir:
    recording, effects = open_recording(folder / truth.file), {}
    if truth.hidden and truth.size is not None:
        name, coefficient = HIDDEN_EFFECTS[truth.hidden]
        effects[name] = coefficient(truth.size, float(np.ptp(recording.time)))
    rim = recording.number("cup_height")
    tip = recording.number("fill") + above_liquid(recording)  # above the floor, at the start
    if not tip < truth.true_fill_m <= rim:
        raise ValueError(
            f"{folder / truth.file}: true_fill_m {truth.true_fill_m:g} m is not between the "
            f"stick's tip, {tip:g} m above the floor, and the cup's rim, {rim:g} m"
        )
    stem = Path(truth.file).stem
    return ReferenceStir(stem, recording, truth.viscosity_Pa_s, truth.true_fill_m, effects)
