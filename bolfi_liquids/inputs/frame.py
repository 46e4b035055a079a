"""Whether the stick's inclination and the gripper's positions are told in one frame.

A cup is round, and a stick hangs freely. So the inclination xz + i yz, as a complex number,
answers the gripper's x + i y by one real response in time, the same in all directions. A frame
that is turned multiplies it by a phase. The wrong sign of one plane, or planes that are
exchanged, conjugate it. Least squares find both, without any simulator.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .fields import PLANES
from .recording import Recording

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
    path = recording.gripper.position[:, :2]
    inclination = recording.inclination @ (1.0, 1j)
    seen = np.isfinite(inclination)
    travel = (np.nanmax(path, axis=0) - np.nanmin(path, axis=0)).max()
    if travel < MIN_TRAVEL or seen.sum() < N_BLOCKS * MIN_SAMPLES_PER_BLOCK:
        return None
    delayed, inclination = _delayed(recording)[seen], inclination[seen]
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


def _delayed(recording: Recording) -> NDArray[np.complex128]:
    """The gripper's x + i y at each sample, and each delay before it, shape (T, delays)."""
    time, way = recording.time, 0.0
    for axis, factor in zip(recording.gripper.position.T[:2], (1.0, 1j), strict=True):
        known = np.isfinite(axis)
        before = [np.interp(time - delay, time[known], axis[known]) for delay in DELAYS]
        way = way + factor * np.stack(before, axis=-1)
    return np.asarray(way)


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
