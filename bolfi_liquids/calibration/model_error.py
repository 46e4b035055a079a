"""The simulator's own error: what is known of it, and what it leaves on clean recordings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import Argument, InputError
from ..inputs.recording import Recording
from ..models import stirring_error
from ..simulators import StirSimulator, same_liquid, stir_simulator
from .stirs import (
    camera_noise,
    effects_of,
    frame_interval,
    rms,
    same_experiment,
    same_rate,
    sensor_noise,
    stir_experiment,
)
from .summary import unexplained

if TYPE_CHECKING:
    from ..inference import Prior
    from ..inference.criticism import ModelError, Report
    from ..inference.simulations import Compute

STARTING_RUNS = 4  # of each clean recording, all over the prior; as many follow near the best
CLEAN_RUNS = 2 * STARTING_RUNS
VISCOSITY_FACTOR = 2.0  # over which the simulator's error changes

RIG_SIZES = ("cup_radius", "stick_radius", "stick_length")
"""Attributes of a recording that make two rigs the same."""

SIZE_TOLERANCE = 0.02
"""Relative difference up to which two sizes are the same."""

SHORT_PART = 0.5
"""Size of the part of the known error that is forgotten soon, over that of the other."""

SHORT_TIME = 0.1
"""Time over which it is forgotten [s]."""

KNOWN_FREEDOM = 5.0
"""Clean recordings that the known error counts as. In the reference's recordings the simulator errs
by 0.5 to 1.6 times as much, or by nothing: as well is a size known from five numbers."""


@dataclass(frozen=True, eq=False)
class Clean:
    """A clean recording, and what the calibrated simulator leaves of it.

    Attributes:
        recording: The recording.
        residual: Recorded less expected [rad], shape (T, 2), NaN where missing.
        viscosity: Most probable [Pa s].
        simulations: Made to learn that; 0 where it was known.
    """

    recording: Recording
    residual: NDArray[np.float64]
    viscosity: float
    simulations: int

    @property
    def error(self) -> float:
        """RMS of the residual beyond the cameras' noise [rad]."""
        return unexplained(rms(self.residual), sensor_noise(self.recording.inclination))


def clean_residuals(
    recordings: "Sequence[Recording | Clean]",
    particles: int,
    prior: "Prior",
    compute: "Compute",
    report: "Report",
) -> list[Clean]:
    """Calibrate the simulator on each of them in turn, where that was not done before.

    Args:
        recordings: Clean ones.
        particles: Number of particles of the simulated liquid; 0: cells follow the stick.
        prior: Of the liquid's parameters.
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
            experiment, prior, effects_of("stir"), compute, report=counted, start=STARTING_RUNS
        )
        return Clean(recording, left.residual, left.best["viscosity"], sum(made))

    return [one if isinstance(one, Clean) else learn(one) for one in recordings]


def check_beside(stirring: StirSimulator, recordings: Sequence[Recording], option: str) -> None:
    """Refuse recordings that cannot be compared with those of a run.

    Args:
        stirring: What the run is calibrated on.
        recordings: Others of the same rig.
        option: Under which they were given: those of "held_out" are of the same liquid, each once
            and under a name of its own; those of "baseline" have the same frame rate.

    Raises:
        InputError: One of them is not.
    """
    for at, recording in enumerate(recordings):
        for what, fix in _faults(stirring, recording, recordings[:at], option):
            raise InputError(what, where=Argument(f"{option} {recording.path}"), fix=fix)


def _faults(
    stirring: StirSimulator, recording: Recording, before: Sequence[Recording], option: str
) -> Iterator[tuple[str, str]]:
    """Yield each fault of a recording and its cure; see `check_beside`.

    Args:
        stirring, option: As there.
        recording: One of the recordings.
        before: Those before it.
    """
    first, known = stirring.recordings[0], {one.hash for one in stirring.recordings}
    if option == "held_out" and any(
        one.hash == recording.hash or one.path.name == recording.path.name for one in before
    ):
        yield (
            "is held out twice, or has the name of another",
            "give each recording once, and each a name of its own",
        )
    if recording.hash in known:
        why = "nothing can be proved on data that are fitted"
        if option == "baseline":
            why = "this one would count as free of errors"
        yield "is what the run is calibrated on", f"give another recording: {why}"
    for name in RIG_SIZES:
        there, here = recording.number(name), first.number(name)
        if abs(there - here) > SIZE_TOLERANCE * abs(here):
            what = f"{name} is {there:g}, but {here:g} in {first.path.name}"
            yield what, "give recordings of the same rig"
    if option == "held_out" and not same_liquid(recording, first):
        there, here = (one.number("liquid_density") for one in (recording, first))
        yield (
            f"liquid_density is {there:g} kg/m3, but {here:g} in {first.path.name}",
            "hold out a recording of the same liquid",
        )
    if option == "baseline" and not same_rate(recording, first):
        there, here = (1.0 / frame_interval(one) for one in (recording, first))
        yield (
            f"has {there:.3g} samples a second, but {first.path.name} {here:.3g}",
            "give recordings of the same frame rate",
        )


def model_error(
    stirring: StirSimulator,
    viscosity: float,
    clean: Sequence[Clean] = (),
    *,
    elsewhere: bool = False,
) -> "ModelError":
    """The simulator's error on a run's recordings, in a liquid of so many Pa s.

    Clean recordings show which multiple of the known error it makes, and those nearest in viscosity
    count most. One of the same path and of a liquid like this one shows where on it, too.

    Args:
        stirring: The simulator, and what was recorded.
        viscosity: Of the model that may lack an effect.
        clean: Clean recordings.
        elsewhere: Whether it is for a path of which there is no clean recording.
    """
    from ..inference.criticism import CleanData, KnownNoise, learned_model_error

    known = stirring_error(viscosity)
    only = stirring.recordings[0] if len(stirring.recordings) == 1 and not elsewhere else None

    def here(one: Clean) -> CleanData:
        """What the simulator would leave of it in a liquid of this viscosity."""
        share = known / stirring_error(one.viscosity)
        # the whole recording tells white noise better than the short rest tells correlated noise
        noise = KnownNoise(share * sensor_noise(one.recording.inclination))
        same = only is not None and same_experiment(one.recording, only)
        distance = regime_distance(one.viscosity, viscosity, stirring.least_viscosity)
        return CleanData(share * one.residual, noise, same, distance)

    return learned_model_error([here(one) for one in clean], known_error(stirring, known))


def known_error(stirring: StirSimulator, size: float) -> "ModelError":
    """An error of this size [rad], as the simulator makes it on a run's recordings.

    It has two parts. One is correlated as the recorded inclination is: in the reference's oil the
    simulated stick swings as if the viscosity were 8 % larger, which an error with a correlation of
    tenths of seconds would not explain. The other is half as large, beside it, and forgotten within
    tenths of seconds, as most of the error in cream is: whatever does not swing like the stick
    would count as free of errors.
    """
    from ..inference.criticism import model_error, rhythm

    swings = rhythm(stirring.observed)
    lags = frame_interval(stirring.recordings[0]) * np.arange(len(swings))
    share = SHORT_PART**2
    correlation = (swings + share * np.exp(-lags / SHORT_TIME)) / (1.0 + share)
    return model_error(size * np.sqrt(1.0 + share), correlation, KNOWN_FREEDOM)


def regime_distance(one: float, other: float, least: float) -> float:
    """Distance of liquids in units of the errors' correlation.

    The simulator errs by half a degree in water and by less than 0.05 degrees in glycerin.

    Args:
        one, other: Their viscosities [Pa s].
        least: Below it liquids look alike [Pa s].
    """
    ratio = max(one, least) / max(other, least)
    return float(np.log(ratio) / np.log(VISCOSITY_FACTOR))
