"""Stirs of a reference, repeated by the simulator in the same liquid: what is judged of one."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..inputs.fields import PLANE_NAMES
from ..models import Liquid, StirSetup, stir, stirring_error
from ..models.accuracy import LARGEST_ERRORS
from ..models.validation import Case, CaseResult, Curve, Panel, Progress, Row
from .reference_stirs import ReferenceStir

SEEDS = 8
WARM_UP = 10  # samples of a stir that compiles what the timed one runs
CAMERA_NOISE = 0.1
"""Standard deviation of what the reference adds to each angle [deg]."""
MAX_SPREAD = 0.05
"""Largest standard deviation of the inclination over seeds, RMS over time [deg]."""
RMS, SPREAD = "RMS difference [deg]", "spread over seeds [deg]"
RECORDED, SIMULATED = "recorded", "simulated"  # curves of a plot

Simulate = Callable[[ReferenceStir, NDArray[np.int64]], NDArray[np.float64]]
"""(stir, seeds [B]) -> inclination [rad] at the recording's times, shape [B, T, 2]."""


def repeated(reference: ReferenceStir, seeds: NDArray[np.int64]) -> NDArray[np.float64]:
    """The stir in the reference's own liquid; see `Simulate`.

    The setup is that of the recording's file. The true depth is an effect upon it, so that stirs
    of one rig share what is compiled for it. A stick that starts off the vertical belongs to the
    setup, which reads the recording's first samples.
    """
    recording = reference.recording
    liquid = Liquid(reference.viscosity, 0.0, recording.number("liquid_density"))
    effects = {"fill_level": reference.fill - recording.number("fill"), **reference.effects}
    return stir(liquid, recording.gripper, StirSetup.from_recording(recording), seeds, effects)


def replay_case(reference: ReferenceStir, simulate: Simulate = repeated) -> Case:
    """The comparison of one stir with its repetition.

    Args:
        reference: The stir.
        simulate: What repeats it.
    """
    bar = rms_bar(reference.thinnest)
    return Case(
        name=reference.name,
        title=f"{reference.name}, {reference.viscosity:g} Pa s",
        truth="the same inclination in the same liquid",
        source="recording of the reference, camera noise removed",
        unit="deg",
        tolerance=bar,
        settings=_settings(reference),
        run=Replay(reference, simulate),
    )


@dataclass(frozen=True, eq=False)
class Replay:
    """Repeats a stir and compares, as a `Case` runs."""

    reference: ReferenceStir
    simulate: Simulate

    def __call__(self, progress: Progress, seed: int) -> CaseResult:
        """Inclination over time, planes and seeds; NaN if a simulation failed."""
        recording, seeds = self.reference.recording, seed * SEEDS + np.arange(SEEDS)
        begun = replace(self.reference, recording=recording.first(WARM_UP))
        self.simulate(begun, seeds + SEEDS)  # other seeds: nothing of the timed stir is kept
        began = time.process_time()
        signals = np.degrees(self.simulate(self.reference, seeds))
        seconds = time.process_time() - began
        recorded = np.degrees(recording.inclination)
        far = rms(signals - recorded)
        rows = (
            Row.absolute(RMS, 0.0, without_noise(far), rms_bar(self.reference.thinnest)),
            Row.absolute(SPREAD, 0.0, spread(signals), MAX_SPREAD),
        )
        notes = {
            "cpu_s": round(seconds / SEEDS, 3),
            "rms_with_noise_deg": far,
            "failed_seeds": seeds[~np.isfinite(signals).all(axis=(1, 2))],
        }
        progress(1.0)
        return CaseResult(rows, _panels(recording.time, recorded, signals), notes)


def rms_bar(viscosity: float) -> float:
    """Largest RMS difference [deg] that passes in a liquid of this viscosity [Pa s]."""
    return float(np.degrees(stirring_error(viscosity, LARGEST_ERRORS)))


def rms(values: NDArray[np.float64]) -> float:
    """Root mean square, without samples that a camera missed.

    Args:
        values: Differences from what was recorded, shape [..., T, 2]; a sample that is NaN in
            all of [...] was missed.

    Returns:
        In the unit of the values; NaN where a simulation failed or nothing was seen.
    """
    trials = values.reshape(-1, *values.shape[-2:])
    seen = np.isfinite(trials).any(axis=0)
    return float(np.sqrt(np.mean(trials[:, seen] ** 2))) if seen.any() else float("nan")


def without_noise(far: float, recordings: int = 1) -> float:
    """An RMS difference [deg] without the camera noise of so many recordings."""
    rest = far**2 - recordings * CAMERA_NOISE**2
    return float(np.sqrt(np.maximum(rest, 0.0)))  # np.maximum keeps a NaN


def spread(signals: NDArray[np.float64]) -> float:
    """Standard deviation over seeds, RMS over time and planes; signals have shape [B, T, 2]."""
    return float(np.sqrt(np.mean(np.var(signals, axis=0, ddof=1))))


def _settings(reference: ReferenceStir) -> Mapping[str, Any]:
    """All that decides the result besides the seed."""
    recording = reference.recording
    return {
        "recording": recording.hash,
        "viscosity": reference.viscosity,
        "density": recording.number("liquid_density"),
        "fill": reference.fill,
        "effects": dict(reference.effects),
        "seeds": SEEDS,
        "noise_deg": CAMERA_NOISE,
        "max_spread_deg": MAX_SPREAD,
        "setup": StirSetup.from_recording(recording).settings(),
    }


def _panels(time: NDArray, recorded: NDArray, signals: NDArray) -> tuple[Panel, ...]:
    """One a plane; the first of the simulated curves carries the label."""
    return tuple(
        Panel(
            "time [s]",
            f"inclination in the {name} plane [deg]",
            (
                Curve(RECORDED, time, recorded[:, plane], truth=True),
                *(
                    Curve("" if k else SIMULATED, time, trial[:, plane])
                    for k, trial in enumerate(signals)
                ),
            ),
        )
        for plane, name in enumerate(PLANE_NAMES)
    )
