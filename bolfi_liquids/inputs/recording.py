"""A recording of a stir, and the variables of its file."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..inference.notebook_display import html_table

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from xarray import Dataset

AXES = ("x", "y", "z")
PLANES = ("inclination_xz", "inclination_yz")
PLANE_NAMES = ("xz", "yz")
UNITS = {"time": "s", **dict.fromkeys(AXES, "m"), **dict.fromkeys(PLANES, "rad")}
"""Variables of a recording's file, in its order, and their units."""

LENGTHS = ("cup_radius", "cup_height", "fill", "stick_radius", "stick_length")
REQUIRED = (*LENGTHS, "liquid_density")
STICK_WEIGHT = ("stick_density", "stick_mass")
"""Attributes of which one is needed."""

SUBJECTS = {
    "cup": ("cup_radius", "cup_height", "fill"),
    "stick": ("stick_radius", "stick_length", "stick_mass", "stick_density"),
    "liquid": ("liquid_density",),
    "notes": ("status", "reason", "source"),
}
"""Attributes of a recording's file, by what they are of."""

JUMPS = {**dict.fromkeys(AXES, 0.05), **dict.fromkeys(PLANES, np.radians(30.0))}
"""By which a sample leaves both of its neighbours, which agree, if it is torn [m] or [rad].

At 10 Hz that takes an acceleration of 10 m/s2, or a swing of more than 90 degrees.
"""

MAX_TORN_SHARE = 0.01
"""Of torn samples that count as missing; one always may."""

ATTRIBUTE_UNITS = {"stick_mass": "kg", "stick_density": "kg/m³", "liquid_density": "kg/m³"}


class Trajectory(NamedTuple):
    """The path of the gripper, at which the stick pivots."""

    time: NDArray[np.float64]  # (T,) s
    position: NDArray[np.float64]  # (T, 3) m, z up, origin on the cup's axis at its floor


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """One stir, as recorded; arrays and attributes are read-only, missing samples are NaN.

    Attributes:
        time: Times of the samples [s], shape (T,), increasing.
        gripper: The gripper's times [s] and positions [m].
        inclination: Angles of the stick from the downward vertical in the xz and yz planes
            [rad], shape (T, 2), positive towards +x and +y.
        attrs: The file's attributes: geometry [m], densities [kg/m3], `source`, `status`.
        path: The file.
        hash: SHA-256 of the file's bytes, in hexadecimal.
        torn: A sentence for each torn value of the file, which is missing here.
    """

    time: NDArray[np.float64]
    gripper: Trajectory
    inclination: NDArray[np.float64]
    attrs: Mapping[str, float | str]
    path: Path
    hash: str
    torn: tuple[str, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "attrs", MappingProxyType(dict(self.attrs)))

    def __reduce__(self):
        """Processes that simulate need it, and a mapping proxy cannot be pickled."""
        return partial(Recording, **{**vars(self), "attrs": dict(self.attrs)}), ()

    def __repr__(self) -> str:
        told = "; ".join(f"{name} {value}" for name, value in self.subjects().items())
        return f"Recording({str(self.path)!r}: {told})"

    def _repr_html_(self) -> str:
        return html_table("Recording", [("file", self.path), *self.subjects().items()])

    def subjects(self) -> dict[str, str]:
        """Texts about the recording by subject, as far as the file has them."""
        length = f"{self.time[-1] - self.time[0]:.1f} s" if len(self.time) else "0 s"
        parts = {
            subject: [_told(name, self.attrs[name]) for name in names if name in self.attrs]
            for subject, names in SUBJECTS.items()
        }
        return {
            "duration": f"{length} ({len(self.time)} samples)",
            **{subject: ", ".join(told) for subject, told in parts.items() if told},
        }

    def values(self, name: str) -> NDArray[np.float64]:
        """A variable of its file, with SI units, shape (T,)."""
        return along_path(self, self.inclination)[name]

    def number(self, name: str) -> float:
        """A numeric attribute, in SI units."""
        return float(self.attrs[name])

    def first(self, count: int) -> "Recording":
        """As it would be if it had ended after so many samples."""
        time = self.time[:count]
        return replace(
            self,
            time=time,
            gripper=Trajectory(time, self.gripper.position[:count]),
            inclination=self.inclination[:count],
        )


def _told(name: str, value: float | str) -> str:
    """An attribute as a person reads it."""
    if isinstance(value, str):
        return value
    if name in LENGTHS:
        return f"{name.partition('_')[2] or name} {100.0 * value:.3g} cm"
    return f"{value:.4g} {ATTRIBUTE_UNITS.get(name, '')}".strip()


def recording_dataset(values: Mapping[str, NDArray], attrs: Mapping[str, float | str]) -> "Dataset":
    """The content of a recording's file; nothing is checked.

    Args:
        values: `time`, the gripper's axes and the inclinations by the names of the file, (T,).
        attrs: The file's attributes.
    """
    from xarray import Dataset

    samples = {name: ("time", values[name], {"units": unit}) for name, unit in UNITS.items()}
    return Dataset(samples, attrs=attrs).set_coords("time")


def planned_recording(
    time: "ArrayLike", position: "ArrayLike", attrs: Mapping[str, float | str]
) -> Recording:
    """A stir that was not made yet, as a recording that has seen nothing.

    Args:
        time: Of the path [s], shape (T,), increasing. What is simulated is sampled at these
            times, so let them be about as far apart as the cameras' frames.
        position: Of the gripper [m], shape (T, 3).
        attrs: As a recording's: geometry and densities.

    Raises:
        InputError: The density of the liquid is missing, or the path is no path.
    """
    time, position = np.array(time, np.float64), np.array(position, np.float64)
    rises = time.ndim == 1 and len(time) > 2 and bool((np.diff(time) > 0).all())
    if not rises or position.shape != (len(time), 3) or not np.isfinite(position).all():
        raise InputError(
            f"times of shape {time.shape} and positions of shape {position.shape}",
            where="planned path",
            fix="give (T,) increasing times in s and (T, 3) finite positions in m",
        )
    if "liquid_density" not in attrs:
        where = "plan: attribute liquid_density"
        raise InputError("missing", where=where, fix="weigh the liquid")
    unseen = np.full((len(time), 2), np.nan)
    path = Trajectory(time, position)
    return Recording(time, path, unseen, dict(attrs), Path("plan"), "")


def along_path(recording: Recording, inclination: NDArray) -> dict[str, NDArray]:
    """Values of a recording's file: another inclination (T, 2) [rad] on the same path."""
    columns = [recording.time, *recording.gripper.position.T, *np.asarray(inclination).T]
    return dict(zip(UNITS, columns, strict=True))


def as_recording(dataset: "Dataset", path: Path, content: bytes) -> Recording:
    """Recording of a file's variables and attributes; nothing is checked.

    A few torn values are missing in the recording, and named in its `torn`.

    Args:
        dataset: With the fields and units that `bolfi-liquids guide recordings` lists.
        path: The file that it was read from.
        content: Its bytes.
    """

    values = {name: dataset[name].to_numpy() for name in UNITS}
    torn = _without_torn(values)
    time = _frozen(values["time"])
    return Recording(
        time=time,
        gripper=Trajectory(time, _frozen(np.stack([values[name] for name in AXES], axis=-1))),
        inclination=_frozen(np.stack([values[name] for name in PLANES], axis=-1)),
        attrs={str(k): _plain(v) for k, v in dataset.attrs.items()},
        path=path,
        hash=hashlib.sha256(content).hexdigest(),
        torn=torn,
    )


def steps(time: NDArray, position: NDArray) -> tuple[NDArray, NDArray]:
    """Way [m] and time [s] from each sample to the next, shape (T - 1,), of positions (T, 3)."""
    return np.linalg.norm(np.diff(position, axis=0), axis=1), np.diff(time)


def torn_values(values: NDArray, jump: float) -> NDArray[np.bool_]:
    """Which values lie far from both of their neighbours, while these agree.

    Args:
        values: Shape (T,); NaN where one is missing, which is no neighbour. Those of an end are the
            next two.
        jump: Smallest distance from the neighbours.

    Returns:
        Shape (T,).
    """
    torn = np.zeros(len(values), bool)
    known = np.flatnonzero(np.isfinite(values))
    if len(known) < 3:
        return torn
    value = values[known]
    before, after = np.r_[value[2], value[:-1]], np.r_[value[1:], value[-3]]
    agree = np.abs(after - before) < 0.5 * jump
    torn[known] = agree & (np.abs(value - before) > jump) & (np.abs(after - value) > jump)
    return torn


def _without_torn(values: dict[str, NDArray]) -> tuple[str, ...]:
    """Replace torn values by NaN where they are few; a sentence for each."""
    torn = {name: torn_values(values[name], jump) for name, jump in JUMPS.items()}
    count = np.any(list(torn.values()), axis=0).sum()
    if not 0 < count <= max(1.0, MAX_TORN_SHARE * len(values["time"])):
        return ()
    told = []
    for name, at in torn.items():
        unit = UNITS[name]
        for sample in np.flatnonzero(at):
            told.append(
                f"{name}: {values[name][sample]:.6g} {unit} of sample {sample} "
                f"({values['time'][sample]:.13g} s) jumps out and back, and counts as missing"
            )
        values[name] = np.where(at, np.nan, values[name])
    return tuple(told)


def _frozen(values: NDArray) -> NDArray[np.float64]:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def _plain(value: Any) -> Any:
    """NumPy's scalars and one-element arrays as Python's own, so that they can be written."""
    return value.item() if isinstance(value, np.ndarray | np.generic) and value.size == 1 else value
