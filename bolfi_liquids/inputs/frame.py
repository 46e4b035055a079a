"""Whether the stick's inclination and the gripper's positions are told in one frame and one time.

A cup is round, and a stick hangs freely. So both planes of the inclination answer x and y of the
gripper by one real response in time. A fault of frame, camera or clock breaks that. Each is tried
at all of its sizes by least squares, without any simulator, and found where it leaves much less of
the inclination unexplained than the simpler ones do.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .recording import AXES, PLANES, Recording

DELAYS = np.array([0.0, 0.05, 0.1, 0.2, 0.3, 0.45])
"""At which the inclination may follow the gripper [s]."""

MIN_SAMPLES = 40
"""In which both planes are seen, before anything is concluded."""

MIN_TRAVEL = 5e-3
"""Of the gripper, along its longer way [m], on which an inclination can be seen to follow."""

MAX_LEFT = 0.7
"""Share of the inclination's variance that a fault may leave unexplained."""

MIN_LEFT = 0.02
"""Share that is left as it is: there is nothing to find below."""

MAX_RATIO = 0.6
"""Of what a fault leaves to what a simpler one leaves."""

MAX_TURN_DEG = 15.0
"""Turn that is let pass: the swirl of a thin liquid turns the answer by up to 10 degrees."""

MAX_TIME = 12.0
"""Time from the start in which faults are sought [s]."""

TURNS_DEG = np.arange(-175.0, 181.0, 5.0)
PLANE_TURNS_DEG = np.r_[-90.0:-MAX_TURN_DEG:5.0, 90.0:MAX_TURN_DEG:-5.0]
PLANE_DELAYS = np.arange(0.05, 0.61, 0.05)  # s
SCALES = (10.0, 57.3, 100.0, 1000.0)
RATES = 1.02 ** np.r_[-35:-1, 2:36]  # true ones of pictures over those of their stamps

CAUSES = {
    (False, 2): f"the signs (`flip`) of {' and '.join(PLANES)}, or of x and y, are wrong",
    (True, 0): f"the sign (`flip`) of {PLANES[1]}, or of y, is wrong",
    (True, 3): "the planes are exchanged",
    (True, 2): f"the sign (`flip`) of {PLANES[0]}, or of x, is wrong",
    (True, 1): "the planes are exchanged, and their signs are wrong",
}
"""What is likely wrong, by whether the frame is mirrored, and its turn in quarters."""


class Explanation(NamedTuple):
    """A fault at one size.

    Attributes:
        path: The gripper's x + i y at each sample and each delay before it that the inclination
            answers if the fault is there, shape (T, delays).
        text: Its description and remedy; "" of what is none.
    """

    path: NDArray[np.complex128]
    text: str


def recording_warnings(recordings: Iterable[Recording]) -> list[str]:
    """A warning for each recording that something stopped, for each torn value and wrong frame."""
    warnings = []
    for one in recordings:
        if one.attrs.get("status") == "aborted":
            warnings.append(
                f"{one.path}: aborted after {one.time[-1] - one.time[0]:.1f} s of stirring "
                f"({one.attrs.get('reason') or 'no reason given'}); a short stir says little"
            )
        warnings += [f"{one.path}: {text}" for text in (*one.torn, *frame_faults(one))]
    return warnings


def named_faults(recordings: Iterable[Recording]) -> tuple[str, ...]:
    """Faults of frames with the names of the files, as a run keeps them."""
    return tuple(f"{one.path.name}: {text}" for one in recordings for text in frame_faults(one))


def frame_faults(recording: Recording) -> Iterator[str]:
    """Yield each fault of a recording's frame."""
    start = recording.time[0] if len(recording.time) else 0.0
    part = recording.first(int(np.searchsorted(recording.time, start + MAX_TIME)))
    position = part.gripper.position[:, :2]
    if np.isfinite(part.inclination).all(axis=1).sum() < MIN_SAMPLES:
        return
    if (np.nanmax(position, axis=0) - np.nanmin(position, axis=0)).max() < MIN_TRAVEL:
        return
    path = _delayed(part, part.time)
    turns = [_residual(part, one.path)[0] for one in _turns(path)]
    if MAX_RATIO * max(turns) < min(turns) < MAX_LEFT:
        return  # on a circle a turn is a delay
    least, fault = _left(part, path), ""
    for explanations in (_turns(path), _mirrors(path), _camera_faults(part, path)):
        if least <= MIN_LEFT:
            break
        tried = [(_left(part, one.path), one.text) for one in explanations]
        left, text = min(tried, key=lambda one: one[0])
        if left < min(MAX_LEFT, MAX_RATIO * least):
            least, fault = left, text
    if fault:
        yield fault


def _turns(path: NDArray[np.complex128]) -> Iterator[Explanation]:
    """The inclination's frame is turned; a small turn is no fault."""
    for turn in TURNS_DEG:
        small = abs(turn) <= MAX_TURN_DEG
        yield Explanation(_turned(path, turn), "" if small else _frame_text(turn, False))


def _mirrors(path: NDArray[np.complex128]) -> Iterator[Explanation]:
    """One of the two frames is left-handed."""
    for turn in TURNS_DEG:
        yield Explanation(_turned(path, turn).conj(), _frame_text(turn, True))


def _frame_text(turn: float, mirrored: bool) -> str:
    """A turn [deg] of the whole frame; of a mirrored one, after the sign of yz was changed."""
    quarters = round(turn / 90.0)
    near = abs(turn - 90.0 * quarters) <= MAX_TURN_DEG
    cause = CAUSES.get((mirrored, quarters % 4)) if near else None
    flip = f" after `flip` of {PLANES[1]}" if mirrored else ""
    return (
        f"the inclination is {'mirrored and ' if mirrored else ''}turned by {turn:g} deg against "
        f"x and y: {cause or f'add {turn:g} to `yaw_deg`{flip}'}; "
        "correct the map of `bolfi-liquids import`, or the axes of the rig"
    )


def _camera_faults(recording: Recording, path: NDArray[np.complex128]) -> Iterator[Explanation]:
    """One plane is late, turned or in another unit, or pictures have stamps of another rate."""
    time = recording.time
    for plane, other in (PLANES, PLANES[::-1]):
        for late in PLANE_DELAYS:
            text = f"{plane} comes {late:.2g} s later than {other}: shift the stamps of either"
            yield Explanation(_of_plane(plane, _delayed(recording, time - late), path), text)
        for turn in PLANE_TURNS_DEG:
            text = (
                f"{plane} alone is turned by {turn:.0f} deg, which no turn of x and y mends: "
                "correct where its camera stands, or calibrate it again"
            )
            yield Explanation(_of_plane(plane, _turned(path, turn), path), text)
        for scale in SCALES:
            text = (
                f"{plane} over {AXES[PLANES.index(plane)]} is {scale:g} times that of {other}: "
                "correct the unit of one of them"
            )
            yield Explanation(_of_plane(plane, scale * path, path), text)
    usual = 1.0 / float(np.median(np.diff(time)))
    for rate in RATES:
        text = (
            f"the inclination follows as in pictures taken at {usual * rate:.3g} Hz, and is given "
            f"at {usual:.3g} Hz: stamp each picture with the time at which it was taken"
        )
        yield Explanation(_delayed(recording, time[0] + (time - time[0]) / rate), text)


def _delayed(recording: Recording, time: NDArray) -> NDArray[np.complex128]:
    """The gripper's x + i y at each of the times (T,) and each delay before, (T, delays)."""
    before = time[:, None] - DELAYS
    known = np.isfinite(recording.gripper.position)
    x, y = (
        np.interp(before, recording.time[known[:, k]], recording.gripper.position[known[:, k], k])
        for k in range(2)
    )
    return x + 1j * y


def _turned(path: NDArray[np.complex128], turn_deg: float) -> NDArray[np.complex128]:
    return np.exp(1j * np.radians(turn_deg)) * path


def _of_plane(
    plane: str, changed: NDArray[np.complex128], path: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """The path, changed for one plane alone."""
    if plane == PLANES[0]:
        return changed.real + 1j * path.imag
    return path.real + 1j * changed.imag


def _left(recording: Recording, path: NDArray[np.complex128]) -> float:
    """Share of the variance that a response to a path leaves: all if the stick would lead it."""
    share, trails = _residual(recording, path)
    return share if trails else 1.0


def _residual(recording: Recording, path: NDArray[np.complex128]) -> tuple[float, bool]:
    """Fit of one response of both planes to a path (T, delays).

    Returns:
        Share of the planes' variance that it leaves; and whether the stick trails what the gripper
        has moved of late, even where it swings in a thin liquid.
    """
    designs, angles = [], []
    for way, plane in zip((path.real, path.imag), recording.inclination.T, strict=True):
        seen = np.isfinite(plane)
        designs.append(way[seen] - way[seen].mean(axis=0))
        angles.append(plane[seen] - plane[seen].mean())
    design, angle = np.concatenate(designs), np.concatenate(angles)
    response = np.linalg.lstsq(design.T @ design, design.T @ angle, rcond=1e-12)[0]
    whole = max(float(angle @ angle), np.finfo(float).tiny)
    moved = design[:, 0] - design.mean(axis=1)
    return float(np.sum((angle - design @ response) ** 2)) / whole, bool(angle @ moved <= 0.0)
