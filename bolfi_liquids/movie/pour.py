"""Pictures of a pour."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from .landed_liquid import Landed, landed, level
from .light import (
    ABSORPTION,
    SCATTERED_COLOUR,
    SCATTERING,
    Picture,
    over,
    through_liquid,
)
from .solids import (
    Shape,
    drawn,
    glass_before,
    glass_behind,
    ring,
    room,
)
from .surface import Glass, surface
from .text import written
from .view import OrthographicView

if TYPE_CHECKING:
    from ..models import Cups, PourFrames

PICTURE_SIZE = 480, 640
AZIMUTH, ELEVATION = np.radians(12.0), np.radians(14.0)
PUDDLE_SPREAD = 0.012  # m that spilled liquid spreads
TABLE_CELL = 0.002  # m
DARKEST_DEPTH = 0.012  # m of liquid
CAPTION_HEIGHT = 0.09  # share of the picture's height that is left free for the caption
DYED, SHINING = (38, 92, 190, 215), (92, 160, 226, 235)
UP = np.array([0.0, 0.0, 1.0])


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
        picture = with_puddle(view, empty, below, cups, count)
        picture = drawn(view, picture, _filled(view, receiver, level(below.caught, cups)))
        picture = drawn(view, picture, glass_behind(source, view))
        picture = through_liquid(view, picture, surface(view, points, spacing, source))
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


def with_puddle(
    view: OrthographicView, below: Picture, lying: Landed, cups: "Cups", count: int
) -> Picture:
    """What was spilled, as a film on the table of the volume that lies there."""
    if not len(lying.spilled):
        return below
    centre, reach = (
        lying.spilled.mean(axis=0),
        np.ptp(lying.spilled, axis=0).max() + 8.0 * PUDDLE_SPREAD,
    )
    bins = max(int(reach / TABLE_CELL), 1)
    edges = [np.linspace(c - reach / 2.0, c + reach / 2.0, bins + 1) for c in centre]
    hits, _, _ = np.histogram2d(*lying.spilled.T, bins=edges)
    volume = cups.liquid_volume / count / (reach / bins) ** 2
    film = gaussian_filter(volume * hits, PUDDLE_SPREAD * bins / reach)

    right, up = view.metres()
    axes, table = view.axes, -cups.pour.lip_height - view.centre[2]
    # the line of sight through each pixel, followed to the height of the table
    toward = (table - up * axes[1, 2] - right * axes[0, 2]) / axes[2, 2]
    x = view.centre[0] + right * axes[0, 0] + up * axes[1, 0] + toward * axes[2, 0]
    y = view.centre[1] + right * axes[0, 1] + up * axes[1, 1] + toward * axes[2, 1]
    places = [(p - edge[0]) / (reach / bins) - 0.5 for p, edge in zip((x, y), edges, strict=True)]
    depth = map_coordinates(film, places, order=1)[..., None]
    # light passes it to the table and back, and no colour is darker than that of a full cup
    dyed = below * np.exp(
        -2.0 * ABSORPTION * np.minimum(depth, DARKEST_DEPTH)
    ) + SCATTERED_COLOUR * (1.0 - np.exp(-SCATTERING * depth))
    edge = np.clip(depth[..., 0] / 3e-4, 0.0, 1.0)
    return over(below, np.clip(dyed, 0.0, 1.0).astype(np.float32), edge.astype(np.float32))
