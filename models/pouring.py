"""Pouring: an action in, the fractions spilled, received and retained out."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from . import runtime
from .coefficients import acting_in
from .cups import Cups
from .faults import faulty
from .liquid import Liquid
from .numerics import POUR_PARTICLES, Numerics
from .packing import checked_seeds, pack_cylinder
from .runtime import CHUNK
from .settled import Packing, SettledPackings

SETTLING = 0.6  # s
_packings = SettledPackings()
DRIP = 1.2  # s beyond the cups' hold; viscous liquids need it, and others end earlier


@dataclass(frozen=True)
class PourAction:
    """Angular velocity of the source [rad/s] and distance from its lip to the receiver's axis [m].

    Scalars or arrays of shape [B].
    """

    angular_velocity: ArrayLike
    distance: ArrayLike


@dataclass(frozen=True)
class PourResult:
    """Fractions of all particles, shape [B] each; they sum to 1, or are NaN if a pour diverged.

    What still flies at the end counts as spilled.
    """

    spilled: np.ndarray
    received: np.ndarray
    retained: np.ndarray


def pour(
    liquid: Liquid,
    action: PourAction,
    cups: Cups,
    seeds: ArrayLike,
    particles: int = POUR_PARTICLES,
    effects: Mapping[str, ArrayLike] | None = None,
) -> PourResult:
    """Where the liquid ends when the source turns about its lip to its final angle and holds.

    Args:
        liquid: B liquids; scalars are shared.
        action: B actions; scalars are shared.
        cups: Geometry.
        seeds: One integer a simulation, shape [B]; it decides the initial packing.
        particles: Number of particles.
        effects: Coefficients of `EFFECTS` by name, scalars or of shape [B]. Those that do not
            act in a pour change nothing, so all that a stir has taught may be given.

    Raises:
        ValueError: lengths do not agree, an action is not finite or does not turn, or an effect
            is unknown.
    Warns:
        FailedSimulation: a pour went wrong; its fractions are NaN.
    """
    seeds = checked_seeds(seeds)
    liquid = liquid.batch(len(seeds))
    acting_in("pour", effects, len(seeds))
    rate = _batch("angular_velocity", action.angular_velocity, len(seeds))
    distance = _batch("distance", action.distance, len(seeds))
    if (rate <= 0).any():
        raise ValueError(f"angular_velocity must be positive [rad/s], got {rate.min()}")
    counts = []
    with runtime.LOCK:
        scene = _scene(cups, particles)
        for low in range(0, len(seeds), scene.slots):
            part = slice(low, low + scene.slots)
            turned = rate[part], distance[part]
            counts.append(_run(scene, cups, liquid[part], turned, seeds[part]))
    spilled, received, retained = np.concatenate(counts, axis=1) / particles
    return PourResult(spilled, received, retained)


def _batch(name: str, value: ArrayLike, size: int) -> np.ndarray:
    array = np.asarray(value, dtype=np.float32)
    if array.ndim > 1 or array.size not in (1, size) or not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite and of shape () or ({size},), got {value}")
    return np.broadcast_to(array, (size,))


@cache
def _scene(cups: Cups, particles: int):
    """The compiled scene; its fields live as long as the process."""
    runtime.start()
    from .pouring_kernel import PouringScene

    spacing = (cups.liquid_volume / particles) ** (1.0 / 3.0)
    return PouringScene(runtime.SLOTS, particles, spacing, Numerics(), cups)


def _run(scene, cups, liquid, action, seeds) -> np.ndarray:
    """Particles spilled, received and retained, shape [3, B]; NaN where a pour diverged."""
    size = len(seeds)
    rate, distance = action
    source = cups.source
    shift = np.array([source.radius, 0.0, source.height], np.float32)

    def settle(places: list[int]) -> list[Packing]:
        scene.place_cups(np.ones(len(places)), np.zeros(len(places)))
        packed = (
            pack_cylinder(source.radius, scene.spacing, scene.particles, int(seeds[k]))
            for k in places
        )
        return scene.settled([points - shift for points in packed], SETTLING)

    packings = _packings.of([(source, scene.particles, seed) for seed in seeds], settle)
    scene.place([p.position for p in packings], [p.multiplier for p in packings])
    scene.place_cups(rate, distance)
    scene.pour_in(liquid)
    hold = cups.pour.hold + DRIP
    steps = int((cups.pour.final_angle / rate.min() + hold) * scene.rate)
    for start in range(0, steps, CHUNK):
        scene.pour(size, start, min(start + CHUNK, steps), hold)
    scene.count(size)
    fields = (scene.spilled, scene.received, scene.retained)
    counts = np.stack([field.to_numpy()[:size] for field in fields]).astype(float)
    counts[:, faulty(scene.fault.to_numpy()[:size], seeds)] = np.nan
    return counts
