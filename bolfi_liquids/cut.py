"""Cutting a recording to the part that can be simulated: from rest, without gaps at its ends."""

from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .errors import Argument, InputError
from .files import existing_file, new_file, write_netcdf
from .inputs.checks import check_times
from .inputs.limits import checked_number
from .inputs.open import check_recording, open_recording, read_fields
from .inputs.recording import Recording, as_recording
from .inputs.start import first_rest


class Cut(NamedTuple):
    """First and last time that stay [s], on the recording's clock."""

    start: float
    stop: float


def trim(
    recording: str | Path, *, start: float | None = None, stop: float | None = None, out: str | Path
) -> Recording:
    """Cut a recording, and write what stays to a new file.

    Args:
        recording: Its file.
        start: First time that stays [s], on the recording's clock; None is the first at which
            gripper and stick rest in the liquid before they stir it.
        stop: Last time that stays [s]; None is the last at which both planes and the gripper are
            seen.
        out: The file to write, .nc; there may be none of that name.

    Returns:
        The part, as `open_recording` opens it.

    Raises:
        InputError: The recording cannot be read, it holds no such times, what stays cannot be
            simulated, or `out` cannot be written. Nothing was written.
    """
    path = existing_file(recording)
    out = new_file(out, Argument("out"), suffix=".nc", replace=False)
    content = path.read_bytes()
    dataset = read_fields(content, path)
    whole = as_recording(dataset, path, content)
    cut = proposed_cut(whole, start, stop)
    kept = (whole.time >= cut.start) & (whole.time <= cut.stop)
    part = dataset.isel(time=np.flatnonzero(kept))
    for name in part.variables:
        part[name].encoding.clear()  # chunks of the whole may be longer than the part
    check_recording(as_recording(part, path, content))
    now = datetime.now(UTC).isoformat(timespec="seconds")
    made = (
        f"{now}: {cut.start:.10g} to {cut.stop:.10g} s of {path.name} ({whole.time[0]:.10g} to "
        f"{whole.time[-1]:.10g} s, SHA-256 {whole.hash}), cut by bolfi-liquids "
        f"{version('bolfi-liquids')}"
    )
    history = [str(dataset.attrs.get("history") or ""), made]
    write_netcdf(part.assign_attrs(history="\n".join(filter(None, history))), out)
    return open_recording(out)


def proposed_cut(
    recording: Recording, start: float | None = None, stop: float | None = None
) -> Cut:
    """Cut that `trim` proposes; times that are given stay as they are.

    Raises:
        InputError: The recording has no such times.
    """
    where, time = str(recording.path), recording.time
    check_times(recording)
    stop = _last_seen(recording) if stop is None else checked_number(stop, Argument("stop"))
    if start is not None:
        start = checked_number(start, Argument("start"))
    elif (start := first_rest(recording)) is None:
        raise InputError(
            "there is no time at which gripper and stick rest in the liquid before a stir",
            where=where,
            fix="record from rest, or give `start`",
        )
    if not time[0] <= stop or not start <= time[-1] or not start < stop:
        raise InputError(
            f"nothing lies from {start:g} to {stop:g} s; it lasts from {time[0]:.10g} to "
            f"{time[-1]:.10g} s",
            where=where,
            fix="give `start` and `stop` within it",
        )
    return Cut(float(start), float(stop))


def _last_seen(recording: Recording) -> float:
    seen = np.isfinite(recording.inclination).all(axis=1)
    seen &= np.isfinite(recording.gripper.position).all(axis=1)
    if not seen.any():
        raise InputError(
            "the stick is never seen in both planes", where=str(recording.path), fix="record again"
        )
    last = recording.time[np.flatnonzero(seen)[-1]]
    return float(np.ceil(1000.0 * last) / 1000.0)  # as it is printed
