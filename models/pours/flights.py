"""Particles that have left the surroundings of the lip: each flies as a stone does."""

from typing import NamedTuple

import numpy as np

from ..apic.gravity import GRAVITY


class Flights(NamedTuple):
    """Flights of the particles of half a cup that have left its region, in that order.

    Attributes:
        place, velocity: In the room's frame, whose origin is the lip [m] and [m/s], shape (n, 3).
        time: Since the cup began to turn [s], shape (n,).
        retained: Share of the liquid that is left in the cup; NaN if the pour went wrong.
        particles: Of half a cup.
    """

    place: np.ndarray
    velocity: np.ndarray
    time: np.ndarray
    retained: float
    particles: int

    def fall(self, drop: float) -> np.ndarray:
        """Time of each from where it left to a height `drop` below the lip [s]; 0 if it was
        there already."""
        up, above = self.velocity[:, 2], np.maximum(self.place[:, 2] + drop, 0.0)
        return (up + np.sqrt(up**2 + 2.0 * GRAVITY * above)) / GRAVITY

    def at(self, since: np.ndarray) -> np.ndarray:
        """Places [m], shape (n, 3), so long after each has left [s]."""
        along = self.place + since[:, None] * self.velocity
        along[:, 2] -= 0.5 * GRAVITY * since**2
        return along

    def left(self, time: np.ndarray) -> np.ndarray:
        """Share of the liquid that has not left by some times [s], shape (m,); NaN if the pour
        went wrong."""
        gone = np.searchsorted(np.sort(self.time), time, side="right") / self.particles
        return np.where(np.isnan(self.retained), np.nan, 1.0 - gone)

    def before(self, time: float, drop: float) -> np.ndarray:
        """Places at a time [s] of those that are still above a height `drop` below the lip [m],
        shape (m, 3)."""
        since = time - self.time
        return self.at(since)[since < self.fall(drop)]


def landing_of(flights: Flights, drop: float) -> np.ndarray:
    """Points at which the whole cup's liquid comes to a height `drop` below the lip [m].

    Returns:
        Towards the receiver and across, float32 of shape (2 particles, 2), in the order in which
        they come there; NaN for what stays in the cup, and for all of a pour that went wrong.
    """
    position = np.full((flights.particles, 2, 2), np.nan, np.float32)
    if not np.isnan(flights.retained):
        fall = flights.fall(drop)
        order = np.argsort(flights.time + fall, kind="stable")
        landed = flights.at(fall)[order, :2]
        position[: len(order), 0] = landed
        position[: len(order), 1] = landed * [1.0, -1.0]  # the other half's
    return position.reshape(-1, 2)
