"""Positions of the particles while they are stirred or poured, for pictures and measurements."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .liquid import Liquid
from .number_checks import check_numbers, checked_seeds
from .pouring import Landings, PourBatch, watched_landings
from .pours.vessel import turned
from .runtime import Watch
from .stir_setup import StirSetup
from .stirring import stir
from .trajectory import PivotPath

FRAME_RATE = 25.0  # frames/s


@dataclass(frozen=True)
class StirFrames:
    """One stir; the cup's frame has its origin on the axis at floor level, z up.

    Attributes:
        time: Of each frame on the gripper's clock [s], shape [F].
        position: Of the particles [m], float32 of shape [F, n, 3].
        pivot: Where the gripper holds the stick [m], shape [F, 3].
        tip: Lower end of the stick's axis [m], shape [F, 3].
        inclination: What `stir` returns [rad], shape [T, 2].
    """

    time: np.ndarray
    position: np.ndarray
    pivot: np.ndarray
    tip: np.ndarray
    inclination: np.ndarray


@dataclass(frozen=True)
class PourFrames:
    """One pour; the world's frame has its origin at the lip, x towards the receiver, z up.

    Attributes:
        time: Of each frame since the source began to turn [s], shape [F].
        position: Of the particles of both halves [m], float32 of shape [F, n, 3]; NaN for what has
            passed the receiver's rim. A row is not the same particle in every frame.
        angle: By which the source has turned [rad], shape [F].
        landed: What `landings` returns, of one pour.
    """

    time: np.ndarray
    position: np.ndarray
    angle: np.ndarray
    landed: Landings


def stir_frames(
    liquid: Liquid,
    gripper: PivotPath,
    setup: StirSetup,
    seed: int,
    *,
    rate: float = FRAME_RATE,
    effects: Mapping[str, ArrayLike] | None = None,
) -> StirFrames:
    """Frames of the very simulation that `stir` makes of one liquid and seed.

    They show what is there, so effects in the sensor change nothing.

    Args:
        liquid: One liquid.
        gripper, setup, effects: As for `stir`.
        seed: Decides the initial packing.
        rate: Frames per second, each at the nearest step; the last is the end of the path.

    Raises:
        ValueError: as `stir`, or the rate is not positive.
    Warns:
        FailedSimulation: the simulation went wrong; positions and tips are NaN.
    """
    check_numbers("frames", rate=rate)
    start, seen = float(np.asarray(gripper.time)[0]), list[tuple[Any, ...]]()

    def look(scene: Any, step: int) -> None:
        position, pivot, direction = scene.view(step)
        tip = pivot + setup.stick.length * direction.astype(np.float64)
        seen.append((start + step / scene.rate, position, pivot, tip))

    angles = stir(liquid, gripper, setup, [seed], effects, Watch(rate, look))
    time, position, pivot, tip = map(np.stack, zip(*seen, strict=True))
    if np.isnan(angles).any():
        position[:], tip[:] = np.nan, np.nan
    return StirFrames(time, position, pivot, tip, angles[0])


def pour_frames(batch: PourBatch, *, rate: float = FRAME_RATE) -> PourFrames:
    """Frames of the very simulation that `landings` makes of one liquid and seed.

    What has landed by a frame are the first rows of `Landings.position`, as many as are NaN in it.

    Args:
        batch: One pour.
        rate: Frames per second, each at the nearest step; the last is the end of the pour.

    Raises:
        ValueError: as `landings`, there are several seeds, or the rate is not positive.
    Warns:
        FailedSimulation: the simulation went wrong; positions are NaN.
    """
    check_numbers("frames", rate=rate)
    pours = checked_seeds(batch.seeds).size
    if pours > 1:
        raise ValueError(f"frames: seeds must be one integer, got {pours}; take one pour at a time")
    seen, turning = list[tuple[Any, ...]](), float(np.ravel(batch.angular_velocity)[0])
    drop = batch.cups.pour.lip_height - batch.cups.receiver.height

    def look(scene: Any, step: int) -> None:
        time = step / scene.rate
        angle = min(turning * time, batch.cups.pour.final_angle)
        held, flights = scene.view()
        half = np.concatenate([turned(held, angle), flights.before(time, drop)])
        whole = np.full((flights.particles, 2, 3), np.nan, np.float32)
        whole[: len(half), 0], whole[: len(half), 1] = half, half * [1.0, -1.0, 1.0]
        seen.append((time, whole.reshape(-1, 3), angle))

    landed = watched_landings(batch, Watch(rate, look))
    time, position, angle = map(np.stack, zip(*seen, strict=True))
    if np.isnan(landed.retained).any():
        position[:] = np.nan
    return PourFrames(time, position, angle, landed)
