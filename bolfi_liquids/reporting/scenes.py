"""Stirs and pours that are shown: one call simulates one liquid, in this process or a worker."""

from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..models import Cups, PourFrames, StirFrames
    from ..simulators import StirSimulator

FRAME_RATE = 15.0
"""Of the pictures [1/s]."""

MOST_SHOWN = 1500
"""Particles of a pour that are shown, so that a page stays small."""


class Draw(NamedTuple):
    """A liquid of the posterior, and the seed with which it is shown."""

    liquid: dict[str, float]
    effects: dict[str, float]
    seed: int


class StirScene(NamedTuple):
    """A stir that can be shown, of any liquid.

    Attributes:
        stirring: Of one recording.
        timeout: Seconds that one simulation may take; None sets no limit.
    """

    stirring: "StirSimulator"
    timeout: float | None

    def __call__(self, draw: Draw) -> "StirFrames":
        from .. import models

        (recording,), (setup,) = self.stirring.recordings, self.stirring.setups
        liquid = models.Liquid(**draw.liquid, density=recording.number("liquid_density"))
        with _limited(self.timeout):
            return models.stir_frames(
                liquid, recording.gripper, setup, draw.seed, rate=FRAME_RATE, effects=draw.effects
            )


class PourScene(NamedTuple):
    """A pour that can be shown, of any liquid.

    Attributes:
        cups: Source and receiver.
        angular_velocity, distance: The chosen action [rad/s], [m].
        density: Of the liquid [kg/m3].
        timeout: Seconds that one simulation may take; None sets no limit.
    """

    cups: "Cups"
    angular_velocity: float
    distance: float
    density: float
    timeout: float | None

    def __call__(self, draw: Draw) -> "PourShown":
        from .. import models

        liquid = models.Liquid(**draw.liquid, density=self.density)
        action = liquid, self.angular_velocity, self.cups, [draw.seed]
        with _limited(self.timeout):
            frames = models.pour_frames(
                models.PourBatch(*action, effects=draw.effects), rate=FRAME_RATE
            )
        landed, radius = frames.landed, self.cups.receiver.radius
        caught = _caught(frames.position, landed.inside(self.distance, radius)[0])
        result = landed.into(self.distance, radius)
        frames = replace(frames, position=_fewer(frames.position))
        return PourShown(frames, caught, float(result.spilled[0]), float(result.retained[0]))


class PourShown(NamedTuple):
    """What a pour looks like, the share caught in each frame, and what became of the liquid."""

    frames: "PourFrames"
    caught: NDArray[np.float64]
    spilled: float
    retained: float


def _caught(position: NDArray, inside: NDArray) -> NDArray:
    """Share of all particles in the receiver, by frame; they land in the order of `inside`."""
    gone = np.isnan(position[..., 0]).sum(axis=1)
    return np.append(0, np.cumsum(inside))[gone] / len(inside)


def _fewer(position: NDArray) -> NDArray:
    """At most `MOST_SHOWN` particles of a pour, of both halves of the cup, whose rows alternate."""
    every = -(-position.shape[1] // MOST_SHOWN)
    return position[:, :: every + 1 - every % 2]


def _limited(timeout: float | None) -> AbstractContextManager[None]:
    """Inside, a simulation that takes longer raises TimeoutError."""
    from ..models import time_limit

    return nullcontext() if timeout is None else time_limit(timeout)
