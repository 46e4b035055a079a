"""Whether the stick's inclination and the gripper's positions are told in one frame.

A cup is round, and a stick hangs freely. So the inclination xz + i yz, as a complex number,
answers the gripper's x + i y by one real response in time, the same in all directions. A frame
that is turned multiplies it by a phase. The wrong sign of one plane, or planes that are
exchanged, conjugate it. Least squares find both, without any simulator. So they do what one camera
alone has suffered, or the stamps of both: each such fault is tried at all of its sizes, and found
where it leaves much less of the inclination unexplained than any frame does.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .recording import PLANES, Recording

DELAYS = (0.0, 0.05, 0.1, 0.2, 0.3, 0.45)
"""At which the inclination may follow the gripper [s]."""

MIN_SAMPLES_PER_BLOCK = 5
N_BLOCKS = 8
"""Parts of a recording that are left out in turn, for the standard error of the turn."""

MIN_TRAVEL = 5e-3
"""Of the gripper, along its longer way [m], on which an inclination can be seen to follow."""

MIN_FOLLOWED = 0.3
"""Share of the inclination's variance that must follow the gripper before anything is concluded."""

MAX_RESIDUAL_RATIO = 0.5
"""Residual of the best frame over that of the worst, or of the unmirrored one: above it the path
does not tell the frames apart, as on a circle, where a turn is a delay."""

MIN_RESIDUAL_SHARE = 1e-3
"""Of the inclination's variance: what is less is as good as nothing."""

MAX_TURN_DEG = 15.0
"""Turn that is let pass: the swirl of a thin liquid turns the answer by up to 10 degrees."""

MAX_TURN_ERRORS = 3.0
"""Standard errors by which a turn must differ from none."""

MAX_FAULT_RATIO = 0.6
"""Residual of a fault of one plane, or of the stamps, over that of the best frame."""

MIN_FAULT_SHARE = 0.02
"""Of the inclination's variance, which the best frame leaves: below, there is no fault to find."""

FAULT_TIME = 12.0
"""Time from the start that faults of planes and stamps are sought in [s]."""

LATE = np.arange(0.05, 0.61, 0.05)
"""Delays of one plane that are tried [s]."""

TURNED = np.radians(np.r_[-90:-MAX_TURN_DEG:5, 90:MAX_TURN_DEG:-5])
"""Turns of one plane that are tried [rad]."""

RATES = 1.02 ** np.r_[-35:-1, 2:36]
"""True rates of the pictures over those of their stamps that are tried."""

CAUSES = {
    (False, 2): f"the signs (`flip`) of {' and '.join(PLANES)}, or of x and y, are wrong",
    (True, 0): f"the sign (`flip`) of {PLANES[1]}, or of y, is wrong",
    (True, 1): "the planes are exchanged",
    (True, 2): f"the sign (`flip`) of {PLANES[0]}, or of x, is wrong",
    (True, 3): "the planes are exchanged, and their signs are wrong",
}
"""What is likely wrong, by whether the frame is mirrored, and its turn in quarters."""


class FrameRotation(NamedTuple):
    """How the frame of the inclination lies to that of the positions.

    Attributes:
        angle_deg: By which positions must be turned to fit, counterclockwise seen from above; of
            a mirrored frame, after the sign of yz was changed. In (-180, 180].
        error_deg: Its standard error.
        mirrored: Whether one of the two is left-handed.
    """

    angle_deg: float
    error_deg: float
    mirrored: bool


def found_turn(recording: Recording) -> FrameRotation | None:
    """The turn of a recording's frame; None where its path does not tell it."""
    if (seen := _both_seen(recording)) is None:
        return None
    delayed, inclination = seen
    straight, mirrored = _fit(inclination, delayed), _fit(inclination.conj(), delayed)
    is_mirrored = mirrored.residual < MAX_RESIDUAL_RATIO * straight.residual
    best = mirrored if is_mirrored else straight
    if best.residual > MAX_RESIDUAL_RATIO * best.worst or best.followed < MIN_FOLLOWED:
        return None
    followed = inclination.conj() if is_mirrored else inclination
    return FrameRotation(
        float(np.degrees(best.angle)), _error_deg(followed, delayed, best.angle), is_mirrored
    )


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
    """What is wrong with the frame of a recording; nothing where none is found."""
    if (fault := _camera_fault(recording)) is not None:
        yield fault
        return
    turn = found_turn(recording)
    if turn is None:
        return
    angle, error = turn.angle_deg, turn.error_deg
    if not turn.mirrored and abs(angle) <= max(MAX_TURN_DEG, MAX_TURN_ERRORS * error):
        return
    quarters = round(angle / 90.0)
    near = abs(angle - 90.0 * quarters) <= MAX_TURN_DEG
    cause = CAUSES.get((turn.mirrored, quarters % 4)) if near else None
    mirrored = "mirrored and " if turn.mirrored else ""
    flip = f" after `flip` of {PLANES[1]}" if turn.mirrored else ""
    yield (
        f"the inclination is {mirrored}turned by {round(angle)} +- {round(error)} deg against x "
        f"and y: {cause or f'add {round(angle)} to `yaw_deg`{flip}'}; "
        "correct the map of `bolfi-liquids import`, or the axes of the rig"
    )


def _both_seen(
    recording: Recording,
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]] | None:
    """Delayed positions and inclination where both planes are seen; None of too few or no stir."""
    path = recording.gripper.position[:, :2]
    inclination = recording.inclination @ (1.0, 1j)
    seen = np.isfinite(inclination)
    travel = (np.nanmax(path, axis=0) - np.nanmin(path, axis=0)).max()
    if travel < MIN_TRAVEL or seen.sum() < N_BLOCKS * MIN_SAMPLES_PER_BLOCK:
        return None
    return _delayed(recording, recording.time)[seen], inclination[seen]


def _delayed(recording: Recording, time: NDArray) -> NDArray[np.complex128]:
    """The gripper's x + i y at each of the times (T,) and each delay before, (T, delays)."""
    way = 0.0
    for axis, factor in zip(recording.gripper.position.T[:2], (1.0, 1j), strict=True):
        known = np.isfinite(axis)
        before = [np.interp(time - delay, recording.time[known], axis[known]) for delay in DELAYS]
        way = way + factor * np.stack(before, axis=-1)
    return np.asarray(way)


def _camera_fault(recording: Recording) -> str | None:
    """What one camera alone, or the stamps of both, have suffered; None where nothing is found."""
    recording = recording.first(
        int(np.searchsorted(recording.time, recording.time[0] + FAULT_TIME))
    )
    if (seen := _both_seen(recording)) is None:
        return None
    delayed, inclination = seen
    frames = [_fit(one, delayed) for one in (inclination, inclination.conj())]
    left, fault = min(_camera_faults(recording), key=lambda one: one[0])
    least = 1.0 - max(frame.followed for frame in frames)
    return fault if least > MIN_FAULT_SHARE and left < MAX_FAULT_RATIO * least else None


def _camera_faults(recording: Recording) -> Iterator[tuple[float, str]]:
    """Share of the inclination's variance that each fault leaves, and its description."""
    time, usual = recording.time, 1.0 / float(np.median(np.diff(recording.time)))
    now = _delayed(recording, time)
    still = [now.real, now.imag]
    for late in LATE:
        before = _delayed(recording, time - late)
        for plane, way in enumerate((before.real, before.imag)):
            name, other = PLANES[plane], PLANES[1 - plane]
            text = f"{name} comes {late:.2g} s later than {other}: shift its stamps, or the other's"
            yield _left(recording, _with(still, plane, way)), text
    for turn in TURNED:
        around = np.exp(1j * turn) * now
        for plane, way in enumerate((around.real, around.imag)):
            text = (
                f"{PLANES[plane]} alone is turned by {np.degrees(turn):.0f} deg, which no turn of "
                "x and y mends: correct where its camera stands, or calibrate it again"
            )
            yield _left(recording, _with(still, plane, way)), text
    for rate in RATES:
        way = _delayed(recording, time[0] + (time - time[0]) / rate)
        text = (
            f"the inclination follows as in pictures taken at {usual * rate:.3g} Hz, and is given "
            f"at {usual:.3g} Hz: stamp each picture with the time at which it was taken"
        )
        yield _left(recording, [way.real, way.imag]), text


def _with(designs: list[NDArray], plane: int, design: NDArray) -> list[NDArray]:
    """The designs of both planes, (T, delays) each, with another one of one plane."""
    return [design if at == plane else one for at, one in enumerate(designs)]


def _left(recording: Recording, designs: list[NDArray]) -> float:
    """Share of both planes' variance that one response to their designs (T, delays) leaves."""
    seen = [np.isfinite(plane) for plane in recording.inclination.T]
    parts = zip(designs, recording.inclination.T, seen, strict=True)
    design, angle = (
        np.concatenate([one[at] - one[at].mean(axis=0) for one, at in part])
        for part in zip(*(((way, at), (angle, at)) for way, angle, at in parts), strict=True)
    )
    left = angle - design @ np.linalg.lstsq(design, angle, rcond=None)[0]
    return float(left @ left) / max(float(angle @ angle), np.finfo(float).tiny)


class _RotationFit(NamedTuple):
    """Angle [rad]; residual sums of squares at it and at its worst; share that it explains."""

    angle: float
    residual: float
    worst: float
    followed: float


def _fit(inclination: NDArray, delayed: NDArray) -> _RotationFit:
    """Inclination = phase x (real response to the delayed positions).

    Turned back by an angle, the inclination is linear in its cosine and sine, and so is what a real
    response leaves of it: the best angle is the eigenvector of a 2 x 2 matrix.
    """
    seen, way = inclination - inclination.mean(), delayed - delayed.mean(axis=0)
    design = np.vstack([way.real, way.imag])
    turned = np.column_stack([_real(seen), _real(-1j * seen)])
    left = turned - design @ np.linalg.lstsq(design, turned, rcond=None)[0]
    (least, most), vectors = np.linalg.eigh(left.T @ left)
    angle = float(np.arctan2(vectors[1, 0], vectors[0, 0]))
    power = max(float(np.sum(np.abs(seen) ** 2)), np.finfo(float).tiny)
    floor = MIN_RESIDUAL_SHARE * power
    # the stick trails what the gripper has moved of late, even where it swings in a thin liquid
    moved = way[:, 0] - way.mean(axis=1)
    if np.sum(np.exp(-1j * angle) * seen * moved.conj()).real > 0.0:
        angle += np.pi
    wrapped = float(np.pi - (np.pi - angle) % (2.0 * np.pi))
    residual, worst = (max(float(value), floor) for value in (least, most))
    return _RotationFit(wrapped, residual, worst, 1.0 - residual / power)


def _real(values: NDArray) -> NDArray:
    return np.concatenate([np.real(values), np.imag(values)])


def _error_deg(inclination: NDArray, delayed: NDArray, angle: float) -> float:
    """Standard error of the angle, by a jackknife over stretches: what is left is correlated."""
    blocks = np.arange(len(inclination)) * N_BLOCKS // len(inclination)
    apart = [
        _fit(inclination[blocks != block], delayed[blocks != block]).angle - angle
        for block in range(N_BLOCKS)
    ]
    wrapped = np.degrees((np.array(apart) + np.pi) % (2.0 * np.pi) - np.pi)
    return float(np.sqrt((N_BLOCKS - 1) / N_BLOCKS * np.sum((wrapped - wrapped.mean()) ** 2)))
