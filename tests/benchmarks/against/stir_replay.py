"""Stirs of a reference, repeated by the simulator in the same liquid: what is judged of one."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from bolfi_liquids.models import Liquid, StirSetup, stir, stirring_error
from bolfi_liquids.models.accuracy import LARGEST_ERRORS
from case import Curve, Panel, Row
from numpy.typing import NDArray

from bolfi_liquids.inputs.recording import PLANE_NAMES

from .stirs import ReferenceStir

SEEDS = 8
WARM_UP = 10  # samples of a stir that compiles what the timed one runs
CAMERA_NOISE = 0.1
"""Standard deviation of what the reference adds to each angle [deg]."""
MAX_SPREAD = 0.05
"""Largest standard deviation of the inclination over seeds, RMS over time [deg]."""

Simulate = Callable[[ReferenceStir, NDArray[np.int64]], NDArray[np.float64]]
"""(stir, seeds [B]) -> inclination [rad] at the recording's times, shape [B, T, 2]."""


class RepeatedStir(NamedTuple):
    """What the simulator made of a stir.

    Attributes:
        signals: Inclination [deg] of each seed, shape [SEEDS, T, 2]; NaN if a simulation failed.
        cpu_s: CPU seconds a stir.
    """

    signals: NDArray[np.float64]
    cpu_s: float


def simulate_stir(reference: ReferenceStir, seeds: NDArray[np.int64]) -> NDArray[np.float64]:
    """The stir in the reference's own liquid; see `Simulate`.

    The setup is that of the recording's file. The true depth is an effect upon it, so that stirs
    of one rig share what is compiled for it. A stick that starts off the vertical belongs to the
    setup, which reads the recording's first samples.
    """
    recording = reference.recording
    liquid = Liquid(reference.viscosity, 0.0, recording.number("liquid_density"))
    effects = {"fill_level": reference.fill - recording.number("fill"), **reference.effects}
    return stir(liquid, recording.gripper, StirSetup.from_recording(recording), seeds, effects)


def repeat_stir(
    reference: ReferenceStir, simulate: Simulate = simulate_stir, seed: int = 0
) -> RepeatedStir:
    """Repeat a stir with `SEEDS` seeds that follow from one, and take the time."""
    seeds = seed * SEEDS + np.arange(SEEDS)
    begun = replace(reference, recording=reference.recording.first(WARM_UP))
    simulate(begun, seeds + SEEDS)  # other seeds: nothing of the timed stir is kept
    began = time.process_time()
    signals = np.degrees(simulate(reference, seeds))
    return RepeatedStir(signals, round((time.process_time() - began) / SEEDS, 3))


def stir_rows(reference: ReferenceStir, signals: NDArray[np.float64]) -> tuple[Row, Row]:
    """Bars of a repeated stir: RMS difference without camera noise, and spread over seeds [deg]."""
    far = without_noise(rms(signals - np.degrees(reference.recording.inclination)))
    return (
        Row.absolute("RMS difference [deg]", 0.0, far, rms_bar(reference.thinnest)),
        Row.absolute("spread over seeds [deg]", 0.0, spread(signals), MAX_SPREAD),
    )


def stir_panels(reference: ReferenceStir, signals: NDArray[np.float64]) -> tuple[Panel, ...]:
    """One a plane; the first of the simulated curves carries the label."""
    time, recorded = reference.recording.time, np.degrees(reference.recording.inclination)
    return tuple(
        Panel(
            "time [s]",
            f"inclination in the {name} plane [deg]",
            (
                Curve("recorded", time, recorded[:, plane], truth=True),
                *(
                    Curve("" if k else "simulated", time, trial[:, plane])
                    for k, trial in enumerate(signals)
                ),
            ),
        )
        for plane, name in enumerate(PLANE_NAMES)
    )


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
