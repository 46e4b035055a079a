"""The stirring experiment as the engine sees it: a simulator, data and a discrepancy."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..inputs.prior import split_parameters
from ..inputs.recording import Recording
from ..run.fluid_simulator import FluidSimulator

if TYPE_CHECKING:
    from ..inference.types import Discrepancy
    from ..models import StirSetup

SAME_DENSITY = 0.02  # relative difference up to which two weighings are of one liquid


@dataclass(frozen=True)
class Stirring(FluidSimulator):
    """One or several recordings of one liquid; their signals are joined along time.

    Attributes:
        recordings: At least one.
        setups: The simulator's geometry and discretisation for each.
    """

    recordings: tuple[Recording, ...]
    setups: tuple["StirSetup", ...]

    def simulate(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """Inclinations (B, T of all recordings, 2) [rad] for parameters of shape (B,).

        Besides the liquid's parameters, theta may hold coefficients of `models.EFFECTS`.
        """
        from .. import models

        liquid, effects = split_parameters(theta)
        signals = [
            models.stir(
                models.Liquid(**liquid, density=recording.number("liquid_density")),
                recording.gripper,
                setup,
                seeds,
                effects,
            )
            for recording, setup in zip(self.recordings, self.setups, strict=True)
        ]
        return np.concatenate(signals, axis=1)

    @property
    def least_viscosity(self) -> float:
        """Viscosity [Pa s] below which no recording distinguishes liquids."""
        return min(
            setup.least_viscosity(recording.number("liquid_density"))
            for recording, setup in zip(self.recordings, self.setups, strict=True)
        )

    @property
    def observed(self) -> NDArray[np.float64]:
        """Recorded inclinations (T of all recordings, 2) [rad], NaN where missing."""
        return np.concatenate([recording.inclination for recording in self.recordings])

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the joined samples [s]; each recording has its own zero."""
        return np.concatenate([recording.time for recording in self.recordings])

    @property
    def member(self) -> NDArray[np.int64]:
        """Which recording each of the joined samples belongs to."""
        return np.repeat(np.arange(len(self.recordings)), [len(r.time) for r in self.recordings])

    def discrepancy(self) -> "Discrepancy":
        """The paper's integral over each recording, summed over the recordings."""
        from ..inference import squared_difference

        parts = [squared_difference(recording.time) for recording in self.recordings]
        ends = np.cumsum([len(recording.time) for recording in self.recordings])[:-1]

        def summed(observed: NDArray, simulated: NDArray) -> float:
            pairs = zip(parts, np.split(observed, ends), np.split(simulated, ends), strict=True)
            return float(sum(part(seen, shown) for part, seen, shown in pairs))

        return summed

    @cached_property
    def settings(self) -> dict[str, Any]:
        """Everything that fixes the simulators, by recording."""
        return {
            f"recording_{at}": setup.settings() for at, setup in enumerate(self.setups, start=1)
        }

    @property
    def identity(self) -> str:
        """A text that two equal simulators share: settings, density and gripper paths."""
        paths = hashlib.sha256()
        for recording in self.recordings:
            paths.update(recording.gripper.time.tobytes())
            paths.update(recording.gripper.position.tobytes())
        densities = [recording.number("liquid_density") for recording in self.recordings]
        return json.dumps([self.settings, densities, paths.hexdigest()], sort_keys=True)


def same_liquid(one: Recording, other: Recording) -> bool:
    """Whether two recordings may be of one liquid, by its weighed density."""
    density = other.number("liquid_density")
    return abs(one.number("liquid_density") - density) <= SAME_DENSITY * density


def stirring_of(recordings: list[Recording], particles: int) -> Stirring:
    """Set up the simulators of recordings of one liquid.

    Raises:
        InputError: The recordings' liquids differ in density.
    """
    from ..models import StirSetup

    first, *others = recordings
    for other in others:
        if not same_liquid(other, first):
            raise InputError(
                f"{other.attrs['liquid_density']} kg/m3, but {first.path} has "
                f"{first.number('liquid_density')} kg/m3",
                where=f"{other.path}: attribute liquid_density",
                fix="calibrate each liquid in a run of its own",
            )
    setups = tuple(StirSetup.from_recording(r, particles=particles) for r in recordings)
    return Stirring(tuple(recordings), setups)
