"""Pouring: an action in; out come the fractions spilled, received and retained.

Nothing that has passed the receiver's rim comes back, so where the receiver stands, and how wide
it is, changes nothing in the fluid: one simulation tells what any receiver would have caught.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import runtime
from .cups import FASTEST, SLOWEST, Cups
from .effect_coefficients import Acting, acting_in, changed_wetting, liquid_sets, with_adhesion
from .liquid import TENSION_AT_ONE, Liquid
from .number_checks import check_numbers, checked_batch, checked_seeds
from .pours.flights import Flights, landing_of
from .pours.march import PourRotation, Pours, march
from .pours.resolution import steps_for
from .pours.vessel import vessel_of
from .runtime import Watch


@dataclass(frozen=True)
class PourAction:
    """Angular velocity of the source [rad/s] and distance from its lip to the receiver's axis [m].

    Scalars or arrays of shape [B].
    """

    angular_velocity: ArrayLike
    distance: ArrayLike


@dataclass(frozen=True)
class PourResult:
    """Fractions of all particles, shape [B] each; they sum to 1, or are NaN if a pour failed.

    What still flies at the end counts where it will land.
    """

    spilled: np.ndarray
    received: np.ndarray
    retained: np.ndarray


@dataclass(frozen=True)
class Landings:
    """Points at which the liquid of B pours passes the height of the receiver's rim.

    Attributes:
        position: Of every particle from below the source's lip, towards the receiver and across
            [m], float32 of shape [B, particles, 2], in the order in which they pass it; NaN for
            what stays in the source.
        retained: Fraction left in the source, shape [B]; NaN if a pour failed.
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
        """Fractions that receivers would have caught, in the shape to which all broadcast.

        Args:
            distance, radius: As for `inside`.
        """
        received = self.inside(distance, radius).mean(axis=-1)
        received = np.where(np.isnan(self.retained), np.nan, received)
        retained = np.broadcast_to(self.retained, received.shape)
        # whole particles, so that what is left of three fractions is not a rounding error
        spilled = np.round((1.0 - received - retained) * self.position.shape[1])
        spilled = spilled / self.position.shape[1] + 0.0  # no negative zero
        return PourResult(spilled, received, retained)


def pour(
    liquid: Liquid,
    action: PourAction,
    cups: Cups,
    seeds: ArrayLike,
    particles: int = 0,
    effects: Mapping[str, ArrayLike] | None = None,
) -> PourResult:
    """Shares of the liquid, by where it ends, when the source turns about its lip and holds.

    Args:
        liquid: B liquids; scalars are shared.
        action: B actions; scalars are shared.
        cups: Geometry, contact angle and hold.
        seeds: One integer a simulation, shape [B]; it decides where particles start.
        particles: About as many; 0: cells follow the cup.
        effects: Coefficients of `EFFECTS` by name, scalars or of shape [B]. Those that do not
            act in a pour change nothing, so all that a stir has taught may be given.

    Raises:
        ValueError: lengths do not agree, an action is not finite, too slow or too fast, the
            number of particles is negative, an effect is unknown, or cells are wider than the
            cup's radius or too many.
    Warns:
        FailedSimulation: a pour went wrong; its fractions are NaN.
    """
    seeds = checked_seeds(seeds)
    distance = checked_batch("distance", action.distance, len(seeds))
    landed = landings(liquid, action.angular_velocity, cups, seeds, particles, effects)
    return landed.into(distance, cups.receiver.radius)


def landings(
    liquid: Liquid,
    angular_velocity: ArrayLike,
    cups: Cups,
    seeds: ArrayLike,
    particles: int = 0,
    effects: Mapping[str, ArrayLike] | None = None,
) -> Landings:
    """Points at which the liquid lands, for receivers at any distance; arguments as for `pour`.

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
    particles: int = 0
    effects: Mapping[str, ArrayLike] | None = None


def watched_landings(batch: PourBatch, watch: Watch | None = None) -> Landings:
    """Landings of a batch, while `watch` looks at each of its scenes."""
    found, cups = _flights(batch, watch), batch.cups
    drop = cups.pour.lip_height - cups.receiver.height
    position = np.stack([landing_of(flights, drop) for flights in found])
    return Landings(position, np.array([flights.retained for flights in found]))


def draining(batch: PourBatch, held: ArrayLike) -> np.ndarray:
    """Share that is left in the source and at its lip when it has been held for some time.

    Args:
        batch: The pours.
        held: Times since the source has come to its final angle [s], up to the hold of its cups,
            shape [T].

    Returns:
        Shape [B, T]; NaN of a pour that went wrong.
    """
    found = _flights(batch)
    turned = batch.cups.pour.final_angle / _checked_rate(batch.angular_velocity, len(found))
    return np.stack(
        [flights.left(at + np.asarray(held)) for flights, at in zip(found, turned, strict=True)]
    )


def _flights(batch: PourBatch, watch: Watch | None = None) -> list[Flights]:
    """Particles that leave the source in each pour."""
    cups, seeds = batch.cups, checked_seeds(batch.seeds)
    acting = acting_in("pour", with_adhesion(batch.liquid, batch.effects, len(seeds)), len(seeds))
    rate = _checked_rate(batch.angular_velocity, len(seeds))
    check_numbers("pour", zero=True, particles=batch.particles)
    cup = cups.source.filled
    vessel = vessel_of(cup, batch.particles)
    steps = steps_for(cup.height, vessel.cell, rate)
    pours = _pours(batch.liquid.batch(len(seeds)), rate, cups, seeds, acting)
    found: list[Flights] = [None] * len(seeds)  # type: ignore[list-item]  filled below
    with runtime.LOCK:
        for kinds, rows, coefficients in liquid_sets(acting, len(seeds)):
            for step in np.unique(steps[rows]):
                part = rows[steps[rows] == step]
                turn = PourRotation(cups.pour.final_angle, cups.pour.hold, float(step))
                alike = pours._replace(coefficients=coefficients).rows(part)
                for at, flights in zip(part, march(vessel, alike, turn, kinds, watch), strict=True):
                    found[at] = flights
    return found


def _pours(
    liquid: Liquid, rate: np.ndarray, cups: Cups, seeds: np.ndarray, acting: tuple[Acting, ...]
) -> Pours:
    cosine = np.full(len(seeds), np.cos(cups.contact_angle))
    return Pours(
        liquid,
        TENSION_AT_ONE * np.asarray(liquid.cohesion, float),
        changed_wetting(cosine, acting),
        rate,
        seeds,
        np.zeros((0, len(seeds))),
    )


def _checked_rate(angular_velocity: ArrayLike, size: int) -> np.ndarray:
    rate = checked_batch("angular_velocity", angular_velocity, size)
    if (rate <= 0).any():
        raise ValueError(f"angular_velocity must be positive [rad/s], got {rate.min()}")
    wrong = rate[(rate < SLOWEST) | (rate > FASTEST)]
    if wrong.size:
        raise ValueError(
            f"angular_velocity must be {SLOWEST} to {FASTEST} rad/s, got {wrong[0]:.4g}; "
            "is it in rad/s?"
        )
    return rate
