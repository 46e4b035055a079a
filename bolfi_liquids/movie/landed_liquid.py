"""Liquid below the receiver's rim: it falls on, and fills the receiver or lies beside it."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..models import Cups, Landings

GRAVITY = 9.81


class Landed(NamedTuple):
    """Of one frame.

    Attributes:
        falling: Particles between the rim and where they come to rest [m], shape [m, 3].
        caught: Fraction of all liquid that is in the receiver.
        spilled: Where the others lie on the table [m], shape [k, 2].
    """

    falling: NDArray[np.float64]
    caught: float
    spilled: NDArray[np.float64]


def landed(
    landings: "Landings", before: int, count: int, interval: float, cups: "Cups", distance: float
) -> Landed:
    """What has become of the first `count` particles that passed the rim, of one pour.

    The simulation ends at the rim. From there each falls as a stone that left the lip at rest
    upright and reached the rim where it did; those of the last interval passed it one after
    another.

    Args:
        landings: Of all particles, in the order in which they pass the rim.
        before: How many had passed it one frame ago.
        count: How many have now.
        interval: Between the two frames [s].
        cups: The cups.
        distance: From the lip to the receiver's axis [m].
    """
    drop, rim = cups.pour.lip_height - cups.receiver.height, cups.receiver.height
    passed = np.asarray(landings.position[0, :count], np.float64)
    inside = landings.inside(distance, cups.receiver.radius)[0, :count]
    age = np.full(count, np.inf)
    fresh = count - before
    age[before:] = interval * (1.0 - (np.arange(fresh) + 0.5) / max(fresh, 1))
    speed = np.sqrt(2.0 * GRAVITY * drop)
    since = np.minimum(age, (np.sqrt(2.0 * GRAVITY * (drop + rim)) - speed) / GRAVITY)
    # the time of the fall to the rim gives the speed at which it went ahead
    ahead = passed[:, 0] * (1.0 + np.where(inside, 0.0, since * GRAVITY / speed))
    caught = float(inside.sum() / landings.position.shape[1])
    height = rim - since * (speed + GRAVITY * since / 2.0)
    rest = np.where(inside, level(caught, cups), 0.0)
    flying = height > rest + 1e-9
    world = np.stack([ahead, passed[:, 1], height - cups.pour.lip_height], axis=1)
    lying = ~inside & ~flying
    return Landed(world[flying], caught, world[lying, :2])


def level(caught: float, cups: "Cups") -> float:
    """Depth of the liquid in the receiver [m], at most the receiver's height."""
    depth = caught * cups.liquid_volume / (np.pi * cups.receiver.radius**2)
    return min(depth, cups.receiver.height)
