"""Pictures of a pour."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .rendering import (
    Glass,
    OrthographicView,
    Shape,
    drawn,
    glass_before,
    glass_behind,
    ring,
    room,
    surface,
    through_liquid,
    written,
)

if TYPE_CHECKING:
    from ..models import Cups, Landings, PourFrames

PICTURE_SIZE = 480, 640
AZIMUTH, ELEVATION = np.radians(12.0), np.radians(14.0)
PUDDLE_SPREAD = 0.012  # m that spilled liquid spreads
PUDDLE_CELL = 0.004  # m between places where liquid lies
CAPTION_HEIGHT = 0.09  # share of the picture's height that is left free for the caption
DYED, SHINING, SPILLED = (38, 92, 190, 215), (92, 160, 226, 235), (70, 150, 235, 190)
UP = np.array([0.0, 0.0, 1.0])
GRAVITY = 9.81


def source_glass(cups: "Cups", angle: float) -> Glass:
    """The source, turned about its lip, which is the origin, by an angle [rad]."""
    source, (s, c) = cups.source, (np.sin(angle), np.cos(angle))
    axis = np.array([s, 0.0, c])
    floor = -source.radius * np.array([c, 0.0, -s]) - source.height * axis
    return Glass(source.radius, source.height, floor, axis)


def receiver_glass(cups: "Cups", distance: float) -> Glass:
    """The receiver, its axis at a distance from the lip [m]."""
    floor = np.array([distance, 0.0, -cups.pour.lip_height])
    return Glass(cups.receiver.radius, cups.receiver.height, floor, UP)


def pour_view(cups: "Cups", distance: float, share: float = 1.0) -> OrthographicView:
    """A camera that sees the source at any angle, the receiver and the table around it; `share` of
    `PICTURE_SIZE` wide."""
    width, height = (round(share * pixels) for pixels in PICTURE_SIZE)
    source, receiver = cups.source, cups.receiver
    high = np.hypot(2.0 * source.radius, source.height)
    low = -cups.pour.lip_height - receiver.radius * np.sin(ELEVATION)
    low -= CAPTION_HEIGHT * (high - low)
    left = -max(2.0 * source.radius, receiver.radius - distance)
    right = max(distance + receiver.radius, source.height)
    scale = min(height / (high - low), width / (right - left)) / 1.12
    centre = float(left + right) / 2.0, 0.0, float(high + low) / 2.0
    return OrthographicView(width, height, float(scale), centre, AZIMUTH, ELEVATION)


def pour_pictures(
    frames: "PourFrames", cups: "Cups", distance: float, caption: Sequence[str], share: float = 1.0
) -> Iterator[NDArray[np.uint8]]:
    """A picture of each frame, of shape [height, width, 3].

    Args:
        frames: Of `models.pour_frames`.
        cups: That they were made with.
        distance: From the lip to the receiver's axis [m].
        caption: Lines for a corner, beside time and fractions.
        share: Of `PICTURE_SIZE`.
    """
    view, count = pour_view(cups, distance, share), frames.position.shape[1]
    spacing, receiver = cups.spacing(count), receiver_glass(cups, distance)
    empty = room(view, [receiver])
    passed = np.isnan(frames.position).any(axis=-1).sum(axis=1)
    for at, (time, position, angle) in enumerate(
        zip(frames.time, frames.position, frames.angle, strict=True)
    ):
        last = max(at - 1, 0)
        interval = float(time - frames.time[last])
        below = landed(frames.landed, int(passed[last]), int(passed[at]), interval, cups, distance)
        source = source_glass(cups, float(angle))
        points = np.concatenate([position[: count - passed[at]], below.falling])
        picture = drawn(view, empty, _puddle(below.spilled, cups))
        picture = drawn(view, picture, _filled(view, receiver, level(below.caught, cups)))
        picture = drawn(view, picture, glass_behind(source, view))
        picture = through_liquid(picture, surface(view, points, spacing, source))
        for glass in (receiver, source):
            picture = drawn(view, picture, glass_before(glass, view))
        spilled = passed[at] / count - below.caught
        lines = [
            f"{time:.2f} s   {np.degrees(angle):.0f}°",
            f"received {below.caught:.0%}, spilled {spilled:.0%}",
        ]
        yield written(picture, lines, caption)


def _filled(view: OrthographicView, receiver: Glass, depth: float) -> list[Shape]:
    """The receiver's far wall, and its liquid up to a level [m]."""
    if depth == 0.0:
        return glass_behind(receiver, view)
    near = ring(receiver, 0.0, view, "near"), ring(receiver, depth, view, "near")[::-1]
    liquid = Shape(np.concatenate(near), DYED), Shape(ring(receiver, depth, view), SHINING)
    return [*glass_behind(receiver, view), *liquid]


def _puddle(spilled: NDArray, cups: "Cups") -> list[Shape]:
    """Shapes of the liquid on the table around places [n, 2]."""
    centres = PUDDLE_CELL * np.unique(np.rint(spilled / PUDDLE_CELL), axis=0)
    table = np.full(len(centres), -cups.pour.lip_height)
    turn = np.linspace(0.0, 2.0 * np.pi, 25)
    disc = PUDDLE_SPREAD * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    return [Shape(centre + disc, SPILLED) for centre in np.column_stack([centres, table])]


class Landed(NamedTuple):
    """Liquid that has landed by one frame.

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
    """Place the first `count` particles of a pour that passed the rim.

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
