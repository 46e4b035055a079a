"""Cups of glass, the stick and the table of a movie."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter

from .light import Layer, Picture, over
from .surface import Glass
from .view import OrthographicView, window

LINE_SUPERSAMPLING = 2  # lines are drawn this many times finer than shown
EDGE, FAINT = (92, 112, 130, 210), (92, 112, 130, 110)
GLASS_COLOUR = (150, 180, 205, 26)
GLINT_COLOUR = (255, 255, 255, 120)
STICK_COLOUR = np.array([0.80, 0.52, 0.30], np.float32)
WALL, TABLE = np.array([[0.965, 0.975, 0.985], [0.86, 0.885, 0.91]], np.float32)
SHADOW, SHADE = np.array([0.35, 0.42, 0.5], np.float32), 0.28


class Shape(NamedTuple):
    """A line, or an area if `width` is 0, through points of the scene [n, 3] in m."""

    points: NDArray
    colour: tuple[int, int, int, int]
    width: int = 0  # in pixels of the finer picture


def drawn(view: OrthographicView, below: Picture, shapes: Sequence[Shape]) -> Picture:
    """A picture with shapes over it; each replaces what earlier ones have in its place."""
    if not shapes:
        return below
    places = [view.pixels(shape.points) for shape in shapes]
    part = window(view, np.concatenate(places), max(shape.width for shape in shapes))
    rows, columns = part
    size = columns.stop - columns.start, rows.stop - rows.start
    finer = tuple(LINE_SUPERSAMPLING * pixels for pixels in size)
    corner = np.array([columns.start, rows.start]) - 0.5
    sheet = Image.new("RGBA", finer)
    pen = ImageDraw.Draw(sheet)
    for place, shape in zip(places, shapes, strict=True):
        at = [tuple(p) for p in LINE_SUPERSAMPLING * (place - corner)]
        if shape.width:
            pen.line(at, fill=shape.colour, width=shape.width, joint="curve")
        else:
            pen.polygon(at, fill=shape.colour)
    # premultiplied, so that no colour of empty pixels bleeds into the edges
    small = np.asarray(sheet.convert("RGBa").reduce(LINE_SUPERSAMPLING), np.float32) / 255.0
    picture = below.copy()
    picture[part] = below[part] * (1.0 - small[..., 3:]) + small[..., :3]
    return picture


def ring(glass: Glass, height: float, view: OrthographicView, part: str = "all") -> NDArray:
    """Points of a cup's circle at `height` above its floor; `part` is all, near or far."""
    side = np.cross(glass.axis, view.axes[2])
    side /= max(np.linalg.norm(side), 1e-9)
    near = np.cross(side, glass.axis)  # of the directions across, the one most towards the camera
    turn = {"all": (0.0, 2.0), "near": (0.0, 1.0), "far": (1.0, 2.0)}[part]
    angle = np.pi * np.linspace(*turn, 73)[:, None]
    circle = np.cos(angle) * side + np.sin(angle) * near
    return glass.floor + height * glass.axis + glass.radius * circle


def glass_behind(glass: Glass, view: OrthographicView) -> list[Shape]:
    """The part of a cup behind its contents."""
    floor, rim = ring(glass, 0.0, view, "far"), ring(glass, glass.height, view, "far")
    return [
        Shape(np.concatenate([floor, rim[::-1]]), GLASS_COLOUR),
        Shape(ring(glass, 0.0, view), GLASS_COLOUR),
        Shape(floor, FAINT, 3),
        Shape(rim, FAINT, 3),
    ]


def glass_before(glass: Glass, view: OrthographicView) -> list[Shape]:
    """The part of a cup in front of its contents."""
    rim, floor = ring(glass, glass.height, view, "near"), ring(glass, 0.0, view, "near")
    glint = [at + share * (to - at) for at, to in [(floor[58], rim[58])] for share in (0.12, 0.9)]
    return [
        Shape(np.concatenate([floor, rim[::-1]]), GLASS_COLOUR),
        Shape(np.array(glint), GLINT_COLOUR, 6),
        Shape(floor, EDGE, 3),
        Shape(np.stack([floor[0], rim[0]]), EDGE, 3),
        Shape(np.stack([floor[-1], rim[-1]]), EDGE, 3),
        Shape(rim, EDGE, 3),
    ]


def stick_layer(view: OrthographicView, pivot: NDArray, tip: NDArray, radius: float) -> Layer:
    """A round stick from the pivot to the tip."""
    ends = np.stack([tip, pivot])
    start, end = view.camera(ends)
    part = window(view, view.pixels(ends), radius * view.scale)
    right, up = view.metres()
    along = end[:2] - start[:2]
    length = np.linalg.norm(along)
    along /= length
    x, y = right[part[1]] - start[0], up[part[0]] - start[1]
    share = np.clip((x * along[0] + y * along[1]) / length, 0.0, 1.0)
    dx, dy = x - share * length * along[0], y - share * length * along[1]
    apart = np.hypot(dx, dy)
    round_off = np.sqrt(np.maximum(1.0 - (apart / radius) ** 2, 0.0))
    lit = 0.55 + 0.45 * round_off - 0.18 * (dx * along[1] - dy * along[0]) / radius
    layer = Layer.empty(view)
    layer.cover[part] = np.clip((radius - apart) * view.scale + 0.5, 0.0, 1.0)
    layer.front[part] = start[2] + share * (end[2] - start[2]) + radius * round_off
    layer.colour[part] = np.clip(lit[..., None] * STICK_COLOUR, 0.0, 1.0)
    return layer


def room(view: OrthographicView, cups: Sequence[Glass]) -> Picture:
    """An empty room with the shadows of upright cups on its table."""
    fade = np.linspace(0.0, 1.0, view.height, dtype=np.float32)[:, None, None]
    picture = np.broadcast_to(WALL + fade * (TABLE - WALL), (view.height, view.width, 3))
    for glass in cups:
        wide = Glass(1.12 * glass.radius, glass.height, glass.floor, glass.axis)
        disc = Shape(ring(wide, 0.0, view), (0, 0, 0, 255))
        dark = 1.0 - drawn(view, np.ones_like(picture), [disc])[..., 0]
        shade = SHADE * gaussian_filter(dark, 0.12 * glass.radius * view.scale)
        picture = over(picture, np.broadcast_to(SHADOW, picture.shape), shade)
    return picture
