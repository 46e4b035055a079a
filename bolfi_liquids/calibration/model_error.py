"""The simulator's own error: the usual one, or what it leaves on clean recordings."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import Argument, InputError
from ..inputs.recording import Recording
from ..models import stirring_error
from ..simulators import StirSimulator, stir_simulator
from .noise import sensor_noise
from .stirs import camera_noise, frame_interval, same_experiment, same_rate, stir_experiment

if TYPE_CHECKING:
    from ..inference import Prior
    from ..inference.criticism import Extension, Report, SumOfNoises, UsualResidual
    from ..inference.simulations import Compute

STARTING_RUNS = 4  # of each clean recording, all over the prior; as many follow near the best
CLEAN_RUNS = 2 * STARTING_RUNS
VISCOSITY_FACTOR = 2.0  # over which the simulator's error changes

RIG_SIZES = ("cup_radius", "stick_radius", "stick_length")
"""Attributes of a recording that make two rigs the same."""

SIZE_TOLERANCE = 0.02
"""Relative difference up to which two sizes are the same."""

SHORT_PART = 0.5
"""Size of the part of the usual error that is forgotten soon, over that of the other."""

SHORT_TIME = 0.1
"""Time over which it is forgotten [s]."""


@dataclass(frozen=True, eq=False)
class Clean:
    """A clean recording, and what the calibrated simulator leaves of it.

    Attributes:
        recording: The recording.
        residual: Recorded less expected [rad], shape (T, 2), NaN where missing.
        viscosity: Most probable [Pa s]; None where the prior has none.
        simulations: Made to learn that.
    """

    recording: Recording
    residual: NDArray[np.float64]
    viscosity: float | None
    simulations: int


def clean_residuals(
    recordings: Sequence[Recording],
    particles: int,
    prior: "Prior",
    extensions: "dict[str, Extension]",
    compute: "Compute",
    report: "Report",
) -> list[Clean]:
    """Calibrate the simulator on each of them in turn.

    Args:
        recordings: Clean ones.
        particles: Number of particles of the simulated liquid; 0: cells follow the stick.
        prior: Of the liquid's parameters.
        extensions: The effects that may act.
        compute: Where simulations are made and kept.
        report: Called with the phase, the number of simulations finished in it since the last
            call, and their number in all.

    Raises:
        RuntimeError: Every simulation of one of them failed.
    """
    from ..inference.criticism import own_residual

    def learn(recording: Recording) -> Clean:
        name, made = recording.path.name, []

        def counted(phase: str, finished: int, total: int) -> None:
            made.append(finished)
            report(f"baseline {name}, {phase}", finished, total)

        cameras = camera_noise([recording])
        experiment = stir_experiment(stir_simulator([recording], particles), cameras, None, name)
        # with one seed for all, no criticism in this run simulates what another did
        left = own_residual(
            experiment, prior, extensions, compute, report=counted, start=STARTING_RUNS
        )
        return Clean(recording, left.residual, left.best.get("viscosity"), sum(made))

    return [learn(recording) for recording in recordings]


def check_rig(stirring: StirSimulator, recording: Recording, where: str) -> None:
    """Raise `InputError` unless a recording has the sizes of the run's rig."""
    for name in RIG_SIZES:
        there, here = recording.number(name), stirring.recordings[0].number(name)
        if abs(there - here) > SIZE_TOLERANCE * abs(here):
            raise InputError(
                f"{name} is {there:g}, but {here:g} in the run",
                where=where,
                fix="give recordings of the same rig",
            )


def check_baseline(stirring: StirSimulator, baseline: Sequence[Recording]) -> None:
    """Raise `InputError` unless clean recordings are of the run's rig and frame rate."""
    first = stirring.recordings[0]
    for recording in baseline:
        check_rig(stirring, recording, Argument(f"baseline {recording.path}"))
        if not same_rate(recording, first):
            there, here = (1.0 / frame_interval(r) for r in (recording, first))
            raise InputError(
                f"has {there:.3g} samples a second, but the run's recording {here:.3g}",
                where=Argument(f"baseline {recording.path}"),
                fix="give recordings of the same frame rate",
            )


def usual_for(
    stirring: StirSimulator,
    clean: Sequence[Clean],
    viscosity: float | None,
    *,
    elsewhere: bool = False,
) -> "UsualResidual | None":
    """Usual error of the simulator at a viscosity [Pa s]; None without clean recordings.

    Args:
        stirring: The simulator, and what was recorded.
        clean: One of the same path, of a liquid like this one, shows where on it the simulator
            errs.
        viscosity: None where it is not known.
        elsewhere: Whether it is for a path of which there is no clean recording.
    """
    from ..inference.criticism import KnownNoise, usual_residual

    if not clean:
        return None
    only = stirring.recordings[0] if len(stirring.recordings) == 1 and not elsewhere else None
    same = [only is not None and same_experiment(one.recording, only) for one in clean]
    # the whole recording tells white noise better than the short rest tells correlated noise
    noises = [KnownNoise(sensor_noise(one.recording.inclination)) for one in clean]
    distances = regime_distance(
        [one.viscosity for one in clean], viscosity, stirring.least_viscosity
    )
    return usual_residual([one.residual for one in clean], noises, same, distances)


def regime_distance(
    known: Sequence[float | None], viscosity: float | None, least: float
) -> NDArray[np.float64]:
    """How far liquids are from another one, as simulator errors go, shape (n,).

    The simulator errs by half a degree in water and by less than 0.05 degrees in glycerin.

    Args:
        known: Their viscosities [Pa s]; all are alike where one is not known.
        viscosity: Of the other [Pa s], by the model that lacks the effect.
        least: Below it liquids look alike [Pa s].
    """
    if viscosity is None or None in known:
        return np.zeros(len(known))
    ratio = np.maximum(np.array(known, float), least) / max(viscosity, least)
    return np.log(ratio) / np.log(VISCOSITY_FACTOR)


@dataclass(frozen=True, eq=False)
class ModelError:
    """The simulator's error on a run's recordings.

    It is that of one viscosity, the best one beside the largest error.

    Attributes:
        usual: The error, as a process over time.
        clean: Names of the recordings from which it was learned; none where it is what is known
            of the simulator.
    """

    usual: "UsualResidual"
    clean: tuple[str, ...] = ()

    @property
    def rms(self) -> float:
        """Of the inclination [rad]."""
        return float(np.sqrt(self.usual.autocovariance[0]))


def model_error(
    stirring: StirSimulator, viscosity: float, clean: Sequence[Clean] = ()
) -> ModelError:
    """The error in a liquid of so many Pa s, learned from clean recordings where there are any.

    Without them it has two parts. One, of size `models.stirring_error`, is correlated as the
    recorded inclination is: in the reference's oil the simulated stick swings as if the viscosity
    were 8 % larger, which an error with a correlation of tenths of seconds would not explain. The
    other is half as large and forgotten within tenths of seconds, as most of the error in cream
    is: whatever does not swing like the stick would count as free of errors.
    """
    from ..inference.criticism import model_error, rhythm

    learned = usual_for(stirring, clean, viscosity)
    if learned is not None:
        return ModelError(learned, tuple(one.recording.path.name for one in clean))
    swings = rhythm(stirring.observed)
    lags = frame_interval(stirring.recordings[0]) * np.arange(len(swings))
    share = SHORT_PART**2
    correlation = (swings + share * np.exp(-lags / SHORT_TIME)) / (1.0 + share)
    return ModelError(model_error(stirring_error(viscosity) * np.sqrt(1.0 + share), correlation))


def noise_beside(stirring: StirSimulator, error: ModelError) -> "SumOfNoises":
    """The cameras' noise and the simulator's error."""
    from ..inference.criticism import KnownNoise, SumOfNoises

    return SumOfNoises((KnownNoise(sensor_noise(stirring.observed)), error.usual))
