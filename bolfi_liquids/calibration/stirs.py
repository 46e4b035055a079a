"""Stirred recordings as experiments that the engine can criticise, and the noise in them."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..inputs.recording import PLANE_NAMES, Recording
from ..inputs.strokes import resting, speed, strokes
from ..simulators import StirSimulator

if TYPE_CHECKING:
    from ..inference.criticism import (
        AutoregressiveNoise,
        Experiment,
        Extension,
        ModelError,
        Noise,
        SumOfNoises,
        Window,
    )

REST_TREND_DEGREE = 2
"""Of the polynomial that the hanging stick follows in the second before it is moved."""

MIN_REST_SAMPLES = 8
"""Samples at rest from which noise can be learned."""

PATH_TOLERANCE, TIME_TOLERANCE = 3e-3, 0.01
"""Differences in position [m] and time [s] up to which two paths are the same. In the reference's
oil the simulator errs by 0.25 deg; on paths that differ by 2 mm these errors differ by 0.07 deg."""

RATE_TOLERANCE = 0.02
"""Relative difference up to which two frame rates are the same."""

SPEED_BINS = 3
"""Stretches of like speed that a stir is cut into, beside its strokes."""

DIFFERENCE_ORDER = 3
"""Of the differences that leave the noise of a smooth signal."""

DIFFERENCE_GAIN = np.sqrt(20.0)
"""Of third differences on white noise: sqrt(binomial(6, 3))."""


def camera_noise(recordings: Sequence[Recording]) -> "AutoregressiveNoise":
    """Noise of the cameras, from the time in which the gripper rests before it stirs.

    Raises:
        InputError: They rest too shortly for that.
    """
    from ..inference.criticism import rest_noise

    seen = [(r.path.name, _longest_seen(r.inclination[resting(r)])) for r in recordings]
    rests = [(name, rest) for name, rest in seen if len(rest) >= MIN_REST_SAMPLES]
    if not rests:
        raise InputError(
            f"fewer than {MIN_REST_SAMPLES} samples before the gripper moves, too few to learn the "
            "cameras' noise from",
            where=", ".join(name for name, _ in seen),
            fix="let the gripper rest for a second before it stirs",
        )
    for name, rest in rests:
        if not np.ptp(rest, axis=0).all():
            raise InputError(
                "an inclination does not change at all before the gripper moves",
                where=name,
                fix="record what the cameras see, noise included",
            )
    return rest_noise([rest for _, rest in rests], trend=REST_TREND_DEGREE)


def _longest_seen(rest: np.ndarray) -> np.ndarray:
    """The part after the last missing sample, or before the first, whichever is longer."""
    missing = np.flatnonzero(~np.isfinite(rest).all(axis=1))
    if not missing.size:
        return rest
    return max(rest[: missing[0]], rest[missing[-1] + 1 :], key=len)


def held_out_noise(one: Recording, fitted: Sequence[Recording]) -> "AutoregressiveNoise":
    """Noise of the cameras in a held-out recording, learned from the fitted ones as well.

    Not the other way round: the fitted recordings learn nothing from the held-out one.

    Raises:
        InputError: None of them rests long enough.
    """
    return camera_noise([one, *(other for other in fitted if same_rate(one, other))])


def stir_experiment(
    stirring: StirSimulator,
    cameras: "AutoregressiveNoise",
    usual: "ModelError | None",
    label: str,
) -> "Experiment":
    """Recordings of one liquid, with the cameras' noise and the simulator's usual residual."""
    from ..inference.criticism import Experiment

    return Experiment(
        stirring.batched,
        stirring.observed,
        cameras if usual is None else with_model_error(cameras, usual),
        stirring.identity,
        label,
        windows(stirring),
    )


def with_model_error(cameras: "Noise", error: "ModelError") -> "SumOfNoises":
    """The cameras' noise and the simulator's error."""
    from ..inference.criticism import SumOfNoises

    return SumOfNoises((cameras, error))


def windows(stirring: StirSimulator) -> tuple["Window", ...]:
    """Strokes in each plane, then speeds in both, over the joined samples."""
    from ..inference.criticism import Window

    def whole(member: int, samples: NDArray[np.bool_], planes: tuple[int, ...]) -> NDArray:
        there = np.zeros((*stirring.member.shape, len(PLANE_NAMES)), bool)
        rows = np.flatnonzero(stirring.member == member)[samples]
        there[rows[:, None], list(planes)] = True
        return there

    found = []
    for member, recording in enumerate(stirring.recordings):
        for stroke in strokes(recording):
            time = recording.time[stroke.samples]
            label = {
                "recording": recording.path.name,
                "stroke": stroke.number,
                "start_s": float(time[0]),
                "stop_s": float(time[-1]),
            }
            for plane, name in enumerate(PLANE_NAMES):
                samples = whole(member, stroke.samples, (plane,))
                found.append(Window({"channel": name, **label}, samples))
        for text, samples in _speeds(recording):
            label = {"recording": recording.path.name, "speed": text}
            found.append(Window(label, whole(member, samples, (0, 1))))
    return tuple(found)


def _speeds(recording: Recording) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Stretches of like speed after the first rest."""
    fast, rest = speed(recording), resting(recording)
    edges = np.linspace(0.0, fast.max(), SPEED_BINS + 1)
    bins = np.clip(np.digitize(fast, edges) - 1, 0, SPEED_BINS - 1)
    for k in range(SPEED_BINS):
        samples = (bins == k) & ~rest
        if samples.any():
            yield f"{100 * edges[k]:.0f} to {100 * edges[k + 1]:.0f} cm/s", samples


def effects_of(scene: str, names: Sequence[str] | None = None) -> dict[str, "Extension"]:
    """The registered effects that act in a scene, "stir" or "pour"; of the named ones only."""
    from ..inference.criticism import Extension
    from ..models import EFFECTS

    acting = {name: EFFECTS[name] for name in names_of_effects(scene, names)}
    return {
        name: Extension(one.prior, one.neutral, one.unit, one.text) for name, one in acting.items()
    }


def names_of_effects(scene: str, names: Sequence[str] | None = None) -> list[str]:
    """Those of `effects_of`, without loading the engine."""
    from ..models import EFFECTS

    considered = EFFECTS if names is None else names
    return [name for name, one in EFFECTS.items() if scene in one.scenes and name in considered]


def same_rate(one: Recording, other: Recording) -> bool:
    """Whether two recordings have one frame rate."""
    step, other_step = frame_interval(one), frame_interval(other)
    return abs(step - other_step) <= RATE_TOLERANCE * other_step


def frame_interval(recording: Recording) -> float:
    """Median time between two samples [s]."""
    return float(np.median(np.diff(recording.time)))


def same_experiment(one: Recording, other: Recording) -> bool:
    """Whether two recordings are of one path, sample by sample."""
    if one.inclination.shape != other.inclination.shape:
        return False
    apart = np.abs(one.gripper.position - other.gripper.position).max()
    late = np.abs((one.time - one.time[0]) - (other.time - other.time[0])).max()
    return bool(apart < PATH_TOLERANCE and late < TIME_TOLERANCE)


def rms(values: NDArray) -> float:
    """Root mean square of the values that are not NaN."""
    return float(np.sqrt(np.nanmean(np.square(values))))


def sensor_noise(inclination: NDArray) -> float:
    """Standard deviation of white noise in a smooth signal.

    Third differences remove whatever is locally quadratic and leave the noise, times a known
    gain (von Neumann et al. 1941, with differences of a higher order). On the bundled
    recordings this finds their 0.10 degrees within 1 %.

    Args:
        inclination: Samples of one recording, shape (T, planes), NaN where missing.

    Returns:
        Standard deviation in the signal's unit, over all planes; 0 where no four neighbouring
        samples were seen.
    """
    differences = np.diff(inclination, DIFFERENCE_ORDER, axis=0)
    return rms(differences) / float(DIFFERENCE_GAIN) if np.isfinite(differences).any() else 0.0


def replicate_noise(replicates: NDArray) -> float:
    """Expected RMS difference between two simulations that differ by their seeds only.

    Args:
        replicates: Signals, shape (seeds, ...), at least two seeds.

    Returns:
        RMS in the signal's unit: the square root of twice the variance between seeds, as the
        liquid in the cup has an initial packing of its own, too.
    """
    return float(np.sqrt(2.0 * np.mean(np.var(replicates, axis=0, ddof=1))))


def irreducible_rms(recordings_inclination: list[NDArray], replicates: NDArray) -> float:
    """RMS that the right model at the right parameters would leave: both noises in quadrature.

    Args:
        recordings_inclination: Observed samples of each recording, shapes (T, planes).
        replicates: Simulated signals of all recordings joined along time, (seeds, T, planes).
    """
    weights = [np.isfinite(seen).sum() for seen in recordings_inclination]
    variance = np.average([sensor_noise(y) ** 2 for y in recordings_inclination], weights=weights)
    return float(np.sqrt(variance + replicate_noise(replicates) ** 2))
