"""The two simulators of the fluid that every stage uses: stirs and pours."""

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .inputs.prior import split_parameters
from .inputs.recording import Recording

if TYPE_CHECKING:
    from .inference.simulations import BatchSimulator
    from .inference.types import Discrepancy
    from .models import Cups, PourBatch, PourFrames, StirFrames, StirSetup

RATE = "angular_velocity"
"""Of the source [rad/s], among the parameters of a pour."""

SAME_DENSITY = 0.02
"""Relative difference up to which two weighings are of one liquid."""


TOGETHER = 4
"""Simulations that one thread makes at the same time."""


def effect_versions(effects: Iterable[str]) -> list[str]:
    """Names of effects, those of one's own with the digest of the files that define them."""
    from .models.effects import own_effects

    own = own_effects()
    return [f"{name} {own[name]}" if name in own else name for name in effects]


def own_versions(effects: Iterable[str]) -> list[str]:
    """`effect_versions` of those effects that are one's own and registered in this process."""
    from .models.effects import own_effects

    return effect_versions(sorted({*own_effects()} & {*effects}))


class FluidSimulator(ABC):
    """Simulations of the fluid, by name of their parameters."""

    @abstractmethod
    def simulate(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """Signals (B, ...) at theta, name -> (B,)."""

    @property
    @abstractmethod
    def identity(self) -> str:
        """A text that two equal simulators share, and no others."""

    @property
    def identity_with_effects(self) -> str:
        """Its identity where any effect may act: the files of one's own effects decide, too."""
        from .models.effects import own_effects

        own = effect_versions(sorted(own_effects()))
        return json.dumps([self.identity, *own]) if own else self.identity

    @property
    def batched(self) -> "BatchSimulator":
        """`simulate` as the engine calls it: it stops itself when its time is over, and runs with
        other effects share a call."""
        from .inference.simulations import BatchSimulator
        from .models import EFFECTS

        neutral = {name: effect.neutral for name, effect in EFFECTS.items()}
        return BatchSimulator(self.simulate, TOGETHER, time_limit, neutral)


def time_limit(seconds: float) -> AbstractContextManager[None]:
    """Inside, a simulation that takes longer raises TimeoutError."""
    from . import models

    return models.time_limit(seconds)


@dataclass(frozen=True)
class StirSimulator(FluidSimulator):
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
        from . import models

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

    def frames(self, theta: Mapping[str, float], seed: int, rate: float) -> "StirFrames":
        """Frames of one stir, `rate` times a second; of one recording alone."""
        from . import models

        (recording,), (setup,) = self.recordings, self.setups
        liquid, effects = split_parameters(theta)
        named = models.Liquid(**liquid, density=recording.number("liquid_density"))
        return models.stir_frames(named, recording.gripper, setup, seed, rate=rate, effects=effects)

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
        from .inference import squared_difference

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
        """Text that settings, density and gripper paths decide."""
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


def stir_simulator(recordings: list[Recording], particles: int) -> StirSimulator:
    """Set up the simulators of recordings of one liquid.

    Raises:
        InputError: The recordings' liquids differ in density.
    """
    from .models import StirSetup

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
    return StirSimulator(tuple(recordings), setups)


BatchOf = Callable[[Mapping[str, Any], Any], "PourBatch"]
"""(theta, seeds) -> the pours to be made; theta holds liquid, coefficients and `RATE`."""


class PourOutcome(Protocol):
    """Which pours are made of each theta, and what is kept of them; `settings` identify it."""

    def __call__(
        self, batch: BatchOf, theta: Mapping[str, NDArray], seeds: NDArray
    ) -> NDArray[np.float64]:
        """Shape (B, ...) for theta, name -> (B,)."""
        ...

    @property
    def settings(self) -> list[Any]:
        """Settings of an outcome as JSON, its name first."""
        ...


@dataclass(frozen=True)
class PourSimulator(FluidSimulator):
    """Pours of liquids.

    Attributes:
        cups: Source and receiver, and how the source is turned.
        density: Of the liquids [kg/m3].
        outcome: Which pours are made, and what is kept of them.
        effects: Names of those whose coefficients are parameters.
        particles: Number of particles of each liquid; 0: cells follow the cup.
    """

    cups: "Cups"
    density: float
    outcome: PourOutcome
    effects: tuple[str, ...] = ()
    particles: int = 0

    def simulate(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """Outcomes (B, ...) at theta, name -> (B,)."""
        return self.outcome(self.batch, theta, seeds)

    def batch(self, theta: Mapping[str, Any], seeds: Any) -> "PourBatch":
        """Pours at theta: liquid, coefficients of `models.EFFECTS`, and `RATE`."""
        from . import models

        liquid, effects = split_parameters({k: v for k, v in theta.items() if k != RATE})
        named = models.Liquid(**liquid, density=self.density)
        return models.PourBatch(named, theta[RATE], self.cups, seeds, self.particles, effects)

    def frames(self, theta: Mapping[str, float], seed: int, rate: float) -> "PourFrames":
        """Frames of one pour, `rate` times a second, whatever is kept of it."""
        from . import models

        return models.pour_frames(self.batch(theta, [seed]), rate=rate)

    @property
    def identity(self) -> str:
        """Text that outcome, cups, density and effects decide."""
        name, *fixed = self.outcome.settings
        effects = effect_versions(self.effects)
        made_of = [self.cups.settings(self.particles), self.density, effects, *fixed]
        return json.dumps([name, *made_of], sort_keys=True)
