"""Pouring: an action in; out come the fractions spilled, received and retained.

Nothing that has passed the receiver's rim comes back, so where the receiver stands, and how wide
it is, changes nothing in the fluid: one simulation tells what any receiver would have caught.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .cups import Cups
from .effect import Effect
from .effect_coefficients import acting_in, liquid_sets, with_adhesion
from .fluid import runtime
from .fluid.checks import check_numbers
from .fluid.faults import faulty
from .fluid.liquid import Liquid
from .fluid.numerics import POUR_PARTICLES, ParticleNumerics
from .fluid.packing import checked_seeds, pack_cylinder
from .fluid.runtime import Watch
from .fluid.settled import Packing, SettledPackings

SETTLING_TIME = 0.6  # s
_packings = SettledPackings()
SLOWEST, FASTEST = 0.01, 30.0  # rad/s: a pour of three minutes; a cup that is flung
DRIP_TIME = 1.2  # s beyond the cups' hold; viscous liquids need it, and others end earlier


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


@dataclass(frozen=True)
class Landings:
    """Where the liquid of B pours passes the height of the receiver's rim.

    Attributes:
        position: Of every particle from below the source's lip, towards the receiver and across
            [m], float32 of shape [B, particles, 2]; NaN for what has not landed: it is in the
            source, or still in the air.
        retained: Fraction left in the source, shape [B]; NaN if a pour diverged.
    """

    position: np.ndarray
    retained: np.ndarray

    def inside(self, distance: ArrayLike, radius: ArrayLike) -> np.ndarray:
        """Whether receivers would have caught the particles, bool [..., particles].

        Args:
            distance: From the lip to the receiver's axis [m], broadcast against [B]: of shape
                [D, 1], it gives every distance for every pour.
            radius: Of the receiver [m], likewise.
        """
        distance, radius, _ = np.broadcast_arrays(
            np.asarray(distance, np.float32), np.asarray(radius, np.float32), self.retained
        )
        ahead, across = np.moveaxis(self.position, -1, 0)
        reach = np.hypot(ahead - distance[..., None], across)
        return reach < radius[..., None]  # a NaN is in no receiver

    def into(self, distance: ArrayLike, radius: ArrayLike) -> PourResult:
        """What receivers would have caught, in the shape to which all broadcast.

        Args:
            distance, radius: As for `inside`.
        """
        received = self.inside(distance, radius).mean(axis=-1)
        received = np.where(np.isnan(self.retained), np.nan, received)
        retained = np.broadcast_to(self.retained, received.shape)
        # whole particles, so that what is left of three fractions is not a rounding error
        spilled = np.round((1.0 - received - retained) * self.position.shape[1])
        return PourResult(spilled / self.position.shape[1], received, retained)


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
    distance = _batch("distance", action.distance, len(seeds))
    landed = landings(liquid, action.angular_velocity, cups, seeds, particles, effects)
    return landed.into(distance, cups.receiver.radius)


def landings(
    liquid: Liquid,
    angular_velocity: ArrayLike,
    cups: Cups,
    seeds: ArrayLike,
    particles: int = POUR_PARTICLES,
    effects: Mapping[str, ArrayLike] | None = None,
) -> Landings:
    """Where the liquid lands, for receivers at any distance; arguments and errors of `pour`.

    `Landings.into` makes of them what `pour` would have returned, the receiver's distance and
    radius in `cups` aside.
    """
    return watched_landings(PourBatch(liquid, angular_velocity, cups, seeds, particles, effects))


class PourBatch(NamedTuple):
    """Pours that are simulated together: the arguments of `landings`, which explains them."""

    liquid: Liquid
    angular_velocity: ArrayLike
    cups: Cups
    seeds: ArrayLike
    particles: int = POUR_PARTICLES
    effects: Mapping[str, ArrayLike] | None = None


def watched_landings(batch: PourBatch, watch: Watch | None = None) -> Landings:
    """What `landings` returns, while `watch` looks at each of its scenes."""
    cups, particles, seeds = batch.cups, batch.particles, checked_seeds(batch.seeds)
    acting = acting_in("pour", with_adhesion(batch.liquid, batch.effects, len(seeds)), len(seeds))
    liquid = batch.liquid.batch(len(seeds))
    rate = _batch("angular_velocity", batch.angular_velocity, len(seeds))
    if (rate <= 0).any():
        raise ValueError(f"angular_velocity must be positive [rad/s], got {rate.min()}")
    wrong = rate[(rate < SLOWEST) | (rate > FASTEST)]
    if wrong.size:
        raise ValueError(
            f"angular_velocity must be {SLOWEST} to {FASTEST} rad/s, got {wrong[0]:.4g}; "
            "is it in rad/s?"
        )
    check_numbers("pour", particles=particles)
    position = np.empty((len(seeds), particles, 2), np.float32)
    retained = np.empty(len(seeds))
    with runtime.LOCK:
        for kinds, rows, coefficients in liquid_sets(acting, len(seeds)):
            scene = _scene(cups, particles, kinds)
            for low in range(0, len(rows), scene.slots):
                part = rows[low : low + scene.slots]
                held = liquid[part], coefficients[:, part]
                position[part], retained[part] = _run(
                    scene, cups, held, rate[part], seeds[part], watch=watch
                )
    return Landings(position, retained)


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
        runtime.SLOTS, particles, cups.spacing(particles), ParticleNumerics(), cups, effects
    )


def _run(
    scene, cups, held, rate, seeds, *, watch: Watch | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Position and retained fraction as in `Landings`.

    `held` are the liquid and the coefficients [effects, B] of the scene's effects.
    """
    size = len(seeds)
    source = cups.source
    shift = np.array([source.radius, 0.0, source.height], np.float32)

    def settle(places: list[int]) -> list[Packing]:
        scene.place_cups(np.ones(len(places)))
        packed = (
            pack_cylinder(source.radius, scene.spacing, scene.particles, int(seeds[k]))
            for k in places
        )
        return scene.settled([points - shift for points in packed], SETTLING_TIME)

    # by scene too: with effects compiled in, the last bit of a rest may differ
    fixed = cups, scene.particles, tuple(effect.name for effect in scene.effects)
    packings = _packings.of([(fixed, seed) for seed in seeds], settle)
    scene.place([p.position for p in packings], [p.multiplier for p in packings])
    scene.place_cups(rate)
    scene.pour_in(*held)
    hold = cups.pour.hold + DRIP_TIME
    steps = int((cups.pour.final_angle / rate.min() + hold) * scene.rate)
    runtime.run_chunks(scene, steps, lambda start, stop: scene.pour(size, start, stop, hold), watch)
    scene.count(size)
    position = scene.landing.to_numpy()[:size]
    landed = scene.landed.to_numpy()[:size]
    position[np.arange(scene.particles) >= landed[:, None]] = np.nan
    retained = scene.retained.to_numpy()[:size] / scene.particles
    failed = faulty(scene.fault.to_numpy()[:size], seeds)
    position[failed], retained[failed] = np.nan, np.nan
    return position, retained
