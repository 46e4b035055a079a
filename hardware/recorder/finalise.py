"""From the directory of a session to a recording: whatever the session has left."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..rig import Rig
from ..vision.frame import BAD_LINE, Flag
from ..whole_files import write_netcdf
from .directory import VIEWS
from .events import drop_reserve, outcome, read_events
from .stir import Raw, Stir, extract_stir, lost_rows, missed, read_raw

if TYPE_CHECKING:
    from xarray import Dataset

RECORDING = "recording.nc"
PLANES = ("inclination_xz", "inclination_yz")
CAMERAS = "UR arm and two cameras, by bolfi-liquids"


def finalise(directory: str | Path) -> Path:
    """Make the recording of a session; it may have been killed at any time.

    The marker on the gripper tells the delay of each camera, both views are joined, and the stir
    is cut out and resampled at 30 Hz ("To Stir or Not to Stir"). The file is written whole or not
    at all; an earlier one is replaced.

    Args:
        directory: Of the session.

    Returns:
        Path of `recording.nc` in it.

    Raises:
        RigError: What is left is too little for a recording; the message says what is missing.
        OSError: The file cannot be written.
    """
    directory = Path(directory)
    raw = read_raw(directory)
    stir = extract_stir(raw, str(directory))
    drop_reserve(directory)  # room for the recording, where the disk is full
    dataset = _as_dataset(stir, _attributes(directory, raw, stir))
    return write_netcdf(dataset, directory / RECORDING)


def partial(directory: str | Path, until: float = np.inf) -> Stir:
    """The stir so far, of a session that is still going on.

    Args:
        directory: Of the session.
        until: Take nothing after this time of the robot's clock [s].

    Raises:
        RigError: There is too little yet.
    """
    return extract_stir(read_raw(Path(directory)), str(directory), until)


def rig_attributes(rig: Rig) -> dict[str, float]:
    """Attributes that a rig gives: lengths [m], mass [kg], density [kg/m3], speed [m/s]."""
    return {
        "cup_radius": rig.cup.radius,
        "cup_height": rig.cup.height,
        "fill": rig.cup.fill,
        "stick_radius": rig.stick.radius,
        "stick_length": rig.stick.length,
        "stick_mass": rig.stick.mass,
        "liquid_density": rig.liquid.density,
        "speed": rig.stirring.speed,
    }


def _attributes(directory: Path, raw: Raw, stir: Stir) -> dict[str, float | int | str]:
    known, samples = raw.provenance, raw.samples
    status, reason = outcome(read_events(directory), stir.cut)
    late = np.percentile(1e3 * samples["late"], [50, 99, 100])
    attributes: dict[str, float | int | str] = {
        "Conventions": "CF-1.11",
        **rig_attributes(known.rig),
        "status": status,
        "reason": reason,
        "source": str(known.extra.get("source", CAMERAS)),
        "history": f"{known.started}: recorded by bolfi-liquids {known.version}",
        "rig_hash": known.hash,
        "robot_time_origin": stir.origin,
        "sample_rate": _rate(samples["time"]),
        "lost_samples": raw.lost_samples,
        "missed_packages": missed(samples["time"]),
    }
    attributes |= {
        f"loop_late_{name}_ms": float(value)
        for name, value in zip(("p50", "p99", "max"), late, strict=True)
    }
    for view in VIEWS:
        frames, found = raw.frames[view], stir.delays[view]
        doubtful = (frames["flags"].astype(np.int64) & int(BAD_LINE)) != 0
        numbers = {
            "delay": found.delay,
            "delay_error": found.error,
            "marker_residual_px": found.residual,
            "marker_misfit_px": found.misfit,
            "flagged": float(doubtful.mean()),
            "frame_rate": _rate(frames["stamp"]),
            "lost_frames": max(lost_rows(frames["index"]), missed(frames["stamp"])),
        }
        attributes |= {f"camera_{view}_{name}": value for name, value in numbers.items()}
    return attributes


def _rate(time: np.ndarray) -> float:
    return float(1.0 / np.median(np.diff(time)))


def _as_dataset(stir: Stir, attributes: dict[str, float | int | str]) -> "Dataset":
    from xarray import Dataset

    dataset = Dataset(attrs=attributes)
    dataset["time"] = ("time", stir.time, {"units": "s", "long_name": "time on the robot's clock"})
    for axis, values in zip("xyz", stir.position.T, strict=True):
        name = f"gripper (pivot) position, {axis}"
        dataset[axis] = ("time", values, {"units": "m", "long_name": name})
    for k, plane in enumerate(PLANES):
        name = f"stick inclination from the downward vertical in the {plane[-2:]} plane"
        attrs = {"units": "rad", "long_name": name, "ancillary_variables": f"{plane}_error flags"}
        dataset[plane] = ("time", stir.inclination[:, k], attrs)
        attrs = {"units": "rad", "long_name": f"standard error of {plane}"}
        dataset[f"{plane}_error"] = ("time", stir.error[:, k], attrs)
    attrs = {
        "long_name": "doubts that leave the inclination out",
        "flag_masks": np.array([int(flag) for flag in Flag], np.int32),
        "flag_meanings": " ".join(str(flag.name).lower() for flag in Flag),
    }
    dataset["flags"] = ("time", stir.flags.astype(np.int32), attrs)
    return dataset
