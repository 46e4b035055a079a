"""Pouring: an action in, the fractions spilled, received and retained out."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from . import runtime
from .checks import check_numbers
from .coefficients import acting_in, liquid_sets, with_adhesion
from .cups import Cups
from .effect import Effect
from .faults import faulty
from .liquid import Liquid
from .numerics import POUR_PARTICLES, Numerics
from .packing import checked_seeds, pack_cylinder
from .runtime import CHUNK
from .settled import Packing, SettledPackings

SETTLING = 0.6  # s
_packings = SettledPackings()
SLOWEST, FASTEST = 0.01, 30.0  # rad/s: a pour of three minutes; a cup that is flung
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
        ValueError: lengths do not agree, an action is not finite, too slow or too fast, there are
            no particles, or an effect is unknown.
    Warns:
        FailedSimulation: a pour went wrong; its fractions are NaN.
    """
    seeds = checked_seeds(seeds)
    acting = acting_in("pour", with_adhesion(liquid, effects, len(seeds)), len(seeds))
    liquid = liquid.batch(len(seeds))
    rate = _batch("angular_velocity", action.angular_velocity, len(seeds))
    distance = _batch("distance", action.distance, len(seeds))
    if (rate <= 0).any():
        raise ValueError(f"angular_velocity must be positive [rad/s], got {rate.min()}")
    wrong = rate[(rate < SLOWEST) | (rate > FASTEST)]
    if wrong.size:
        raise ValueError(
            f"angular_velocity must be {SLOWEST} to {FASTEST} rad/s, got {wrong[0]:.4g}; "
            "is it in rad/s?"
        )
    check_numbers("pour", particles=particles)
    counts = np.empty((3, len(seeds)))
    with runtime.LOCK:
        for kinds, rows, coefficients in liquid_sets(acting, len(seeds)):
            scene = _scene(cups, particles, kinds)
            for low in range(0, len(rows), scene.slots):
                part = rows[low : low + scene.slots]
                held, turned = (liquid[part], coefficients[:, part]), (rate[part], distance[part])
                counts[:, part] = _run(scene, cups, held, turned, seeds[part])
    spilled, received, retained = counts / particles
    return PourResult(spilled, received, retained)


def _batch(name: str, value: ArrayLike, size: int) -> np.ndarray:
    array = np.asarray(value, dtype=np.float32)
    if array.ndim > 1 or array.size not in (1, size) or not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite and of shape () or ({size},), got {value}")
    return np.broadcast_to(array, (size,))


@cache
def _scene(cups: Cups, particles: int, effects: tuple[Effect, ...] = ()):
    """The scene compiled for liquid effects; its fields live as long as the process."""
    runtime.start()
    from .pouring_kernel import PouringScene

    return PouringScene(
        runtime.SLOTS, particles, cups.spacing(particles), Numerics(), cups, effects
    )


def _run(scene, cups, held, action, seeds) -> np.ndarray:
    """Particles spilled, received and retained, shape [3, B]; NaN where a pour diverged.

    `held` are the liquid and the coefficients [effects, B] of the scene's effects.
    """
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

    # by scene too: with effects compiled in, the last bit of a rest may differ
    fixed = cups, scene.particles, tuple(effect.name for effect in scene.effects)
    packings = _packings.of([(fixed, seed) for seed in seeds], settle)
    scene.place([p.position for p in packings], [p.multiplier for p in packings])
    scene.place_cups(rate, distance)
    scene.pour_in(*held)
    hold = cups.pour.hold + DRIP
    steps = int((cups.pour.final_angle / rate.min() + hold) * scene.rate)
    for start in range(0, steps, CHUNK):
        scene.pour(size, start, min(start + CHUNK, steps), hold)
    scene.count(size)
    fields = (scene.spilled, scene.received, scene.retained)
    counts = np.stack([field.to_numpy()[:size] for field in fields]).astype(float)
    counts[:, faulty(scene.fault.to_numpy()[:size], seeds)] = np.nan
    return counts
