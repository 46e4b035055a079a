"""One renderer of cups, stick and liquid, for movies and the page's moving pictures.

The surface of the liquid is computed from particles in the picture's own pixels (van der Laan,
Green and Sainz 2009): no grid in space, no mesh. A picture of 4000 particles, 640 pixels wide,
takes 25 ms of processor time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.ndimage import distance_transform_edt, gaussian_filter, grey_dilation

from ..drawing import INK

Picture = NDArray[np.floating]
"""Red, green and blue from 0 to 1, shape [height, width, 3]."""

DROP_RADIUS = (3.0 / (4.0 * np.pi)) ** (1.0 / 3.0)  # of a particle's volume, by the spacing
BRIDGED = 0.8  # from each of two drops [spacing]: the liquid between nearer ones is whole
SMOOTHED = 0.7  # sd by which surface and thickness are smoothed [spacing]

ABSORPTION = np.array([62.0, 21.0, 7.0], np.float32)  # 1/m: a blue dye, so that depth is seen
SCATTERED_COLOUR = np.array([0.36, 0.62, 0.86], np.float32)
SCATTERING = 8.0  # 1/m
SKY, GROUND = np.array([1.0, 1.0, 1.0], np.float32), np.array([0.62, 0.68, 0.74], np.float32)
LAMP_DIRECTION = np.array([-0.45, 0.72, 0.53], np.float32)
SHININESS = 60.0
LEAST_REFLECTED = 0.03  # share at normal incidence

LINE_SUPERSAMPLING = 2  # lines are drawn this many times finer than shown
EDGE, FAINT = (92, 112, 130, 210), (92, 112, 130, 110)
GLASS_COLOUR = (150, 180, 205, 26)
GLINT_COLOUR = (255, 255, 255, 120)
STICK_COLOUR = np.array([0.80, 0.52, 0.30], np.float32)
WALL, TABLE = np.array([[0.965, 0.975, 0.985], [0.86, 0.885, 0.91]], np.float32)
SHADOW, SHADE = np.array([0.35, 0.42, 0.5], np.float32), 0.28
TEXT_SIZE, TEXT_MARGIN = 14, 12  # pixels
CAPTION_COLOUR = "#5b6770"


@dataclass(frozen=True)
class OrthographicView:
    """An orthographic camera: it looks from infinitely far, so lengths keep their ratio.

    Attributes:
        width, height: Of the picture [pixels].
        scale: Pixels per metre.
        centre: What is in the middle of the picture [m], of three coordinates.
        azimuth: Of the camera about z [rad]; at 0 it looks along +y, with x to the right.
        elevation: From which it looks down [rad].
    """

    width: int
    height: int
    scale: float
    centre: tuple[float, float, float]
    azimuth: float
    elevation: float

    @property
    def axes(self) -> NDArray[np.float64]:
        """Unit vectors to the picture's right, up in it, and towards the camera: rows of [3, 3]."""
        (s, c), (t, d) = (
            (np.sin(angle), np.cos(angle)) for angle in (self.azimuth, self.elevation)
        )
        return np.array([[c, s, 0.0], [-s * t, c * t, d], [s * d, -c * d, t]])

    def camera(self, points: NDArray) -> NDArray[np.float64]:
        """Points [..., 3] right, up and towards the camera from the centre [m]."""
        return (np.asarray(points, np.float64) - self.centre) @ self.axes.T

    def pixels(self, points: NDArray) -> NDArray[np.float64]:
        """Column and row of points [..., 3] of the scene, shape [..., 2]; (0, 0) is the centre of
        the picture's first pixel, and rows count downwards."""
        right, up, _ = np.moveaxis(self.camera(points), -1, 0)
        middle = (self.width - 1) / 2.0, (self.height - 1) / 2.0
        return np.stack([middle[0] + self.scale * right, middle[1] - self.scale * up], axis=-1)

    def metres(self) -> tuple[NDArray, NDArray]:
        """Place of each pixel right [width] and up [height, 1] from the centre [m]."""
        right = (np.arange(self.width) - (self.width - 1) / 2.0) / self.scale
        up = ((self.height - 1) / 2.0 - np.arange(self.height)) / self.scale
        return right, up[:, None]


def window(view: OrthographicView, places: NDArray, margin: float) -> tuple[slice, slice]:
    """Rows and columns of the picture around places [n, 2], columns and rows as `pixels` gives."""
    reach = int(np.ceil(margin)) + 1
    low = np.clip(np.floor(places.min(axis=0)).astype(int) - reach, 0, (view.width, view.height))
    high = np.clip(
        np.ceil(places.max(axis=0)).astype(int) + reach + 1, low, (view.width, view.height)
    )
    return slice(low[1], high[1]), slice(low[0], high[0])


@dataclass(frozen=True)
class Glass:
    """A cup that holds particles: an open cylinder.

    Attributes:
        radius, height: Inner ones [m].
        floor: Centre of its floor in the scene [m], shape [3].
        axis: Unit vector from there to the opening, shape [3].
    """

    radius: float
    height: float
    floor: NDArray
    axis: NDArray

    def clear_of_walls(self, points: NDArray, distance: float) -> NDArray[np.float64]:
        """Points [n, 3]; those in the cup are moved to be this far [m] from side and floor."""
        offset = points - self.floor
        along = offset @ self.axis
        across = offset - along[:, None] * self.axis
        from_axis = np.linalg.norm(across, axis=1)
        inside = (from_axis < self.radius) & (along > 0.0) & (along < self.height)
        inwards = np.minimum((self.radius - distance) / np.maximum(from_axis, 1e-9), 1.0)
        up = np.maximum(along, distance)
        moved = self.floor + inwards[:, None] * across + up[:, None] * self.axis
        return np.where(inside[:, None], moved, points)


class VisibleSurface(NamedTuple):
    """Liquid that the pixels of a window of the picture show.

    Attributes:
        window: Rows and columns of the picture.
        cover: Share of the pixel behind the liquid, 0 to 1, shape [rows, columns].
        front: How far towards the camera the surface is [m], of the view's centre.
        normal: Of the surface, [rows, columns, 3]: right, up and towards the camera.
        thickness: Of the liquid along the line of sight [m].
    """

    window: tuple[slice, slice]
    cover: NDArray
    front: NDArray
    normal: NDArray
    thickness: NDArray


def surface(
    view: OrthographicView, points: NDArray, spacing: float, glass: Glass
) -> VisibleSurface | None:
    """The liquid's surface.

    Each particle is a drop of its own volume. Drops are blown up until they meet, and the whole
    shrinks by as much again: liquid that is together is smooth, and a single drop keeps its size.

    Args:
        view: The camera.
        points: Particles in the scene [m], shape [n, 3].
        spacing: Between them [m].
        glass: The cup that may hold them; its walls end the liquid.

    Returns:
        None if no point is in the picture.
    """
    drop, shrunk = DROP_RADIUS * spacing, BRIDGED * spacing
    blown, pixels = drop + shrunk, view.scale * spacing
    clear = glass.clear_of_walls(points, drop)
    places, reach = view.pixels(clear), int(np.ceil(view.scale * blown)) + 1
    column, row = np.rint(places).astype(int).T
    seen = (column >= 0) & (column < view.width) & (row >= 0) & (row < view.height)
    if not seen.any():
        return None
    part = window(view, places[seen], reach)
    at = row[seen] - part[0].start, column[seen] - part[1].start
    shape = part[0].stop - part[0].start, part[1].stop - part[1].start

    nearest, count = np.full(shape, -np.inf), np.zeros(shape)
    np.maximum.at(nearest, at, view.camera(clear[seen])[:, 2])
    np.add.at(count, at, 1.0)
    whole = _distance_to(~np.isinf(nearest)) < view.scale * blown
    cover = np.clip(_distance_to(~whole) - view.scale * shrunk, 0.0, 1.0)
    # a paraboloid on top of each particle, which two passes along the axes make
    bulge = -((np.arange(-reach, reach + 1) / view.scale) ** 2) / (2.0 * blown)
    for kernel in (bulge[:, None], bulge[None, :]):
        nearest = grey_dilation(nearest, structure=kernel, mode="constant", cval=-np.inf)
    front = _smoothed(np.where(whole, nearest + drop, 0.0), whole, SMOOTHED * pixels)
    down, right = np.gradient(front, 1.0 / view.scale)
    normal = np.stack([-right, down, np.ones(shape)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    together = spacing * pixels**2 * gaussian_filter(count, SMOOTHED * pixels)
    thickness = np.maximum(together, 2.0 * drop)
    return VisibleSurface(part, cover, front, normal, thickness)


def _distance_to(some: NDArray) -> NDArray:
    """Distance of each pixel from the nearest of some, in pixels."""
    return np.asarray(distance_transform_edt(~some))


def _smoothed(values: NDArray, known: NDArray, sd: float) -> NDArray:
    """Values smoothed over the pixels in which they are known."""
    share = gaussian_filter(known.astype(float), sd)
    return gaussian_filter(values, sd) / np.maximum(share, 1e-6)


class Layer(NamedTuple):
    """Something solid: its colour, where it is, and how near.

    Attributes:
        colour: Shape [height, width, 3].
        cover: Share of each pixel, shape [height, width].
        front: Towards the camera [m], shape [height, width].
    """

    colour: Picture
    cover: NDArray[np.float32]
    front: NDArray[np.float32]

    @classmethod
    def empty(cls, view: OrthographicView) -> "Layer":
        """Nothing, of a picture's size."""
        size = view.height, view.width
        return cls(*(np.zeros(shape, np.float32) for shape in ((*size, 3), size, size)))


def over(below: Picture, colour: Picture, cover: NDArray) -> Picture:
    """`colour` laid over a picture where it covers it."""
    return below + cover[..., None] * (colour - below)


def through_liquid(
    behind: Picture, liquid: VisibleSurface | None, stick: Layer | None = None
) -> Picture:
    """The picture with the liquid in it, and a stick that dips into it.

    Args:
        behind: What is there besides.
        liquid: None if none is seen.
        stick: Seen through half of the liquid where it is behind the surface.
    """
    base = behind if stick is None else over(behind, stick.colour, stick.cover)
    if liquid is None:
        return base
    part, depth = liquid.window, liquid.thickness[..., None]
    passed = behind[part] * np.exp(-ABSORPTION * depth)
    if stick is not None:
        dyed = stick.colour[part] * np.exp(-ABSORPTION * depth / 2.0)
        passed = over(passed, dyed, stick.cover[part])
    passed += SCATTERED_COLOUR * (1.0 - np.exp(-SCATTERING * depth))
    picture = base.copy()
    lit = over(base[part], _lit(passed, liquid.normal), liquid.cover)
    if stick is not None:
        nearer = stick.cover[part] * (stick.front[part] > liquid.front)
        lit = over(lit, stick.colour[part], nearer)
    picture[part] = lit
    return picture


def _lit(passed: Picture, normal: NDArray) -> Picture:
    """Light that has passed the liquid, with the reflection of its surface (Schlick 1994)."""
    up, facing = normal[..., 1:2], np.clip(normal[..., 2:3], 0.0, 1.0)
    reflected = LEAST_REFLECTED + (1.0 - LEAST_REFLECTED) * (1.0 - facing) ** 5
    mirrored = GROUND + (0.5 + 0.5 * up) * (SKY - GROUND)
    halfway = LAMP_DIRECTION / np.linalg.norm(LAMP_DIRECTION) + np.array(
        [0.0, 0.0, 1.0], np.float32
    )
    halfway /= np.linalg.norm(halfway)
    glint = np.clip(normal @ halfway, 0.0, 1.0)[..., None] ** SHININESS
    lit = passed * (0.82 + 0.18 * up) + 0.7 * reflected * (mirrored - passed) + 0.55 * glint
    return np.clip(lit, 0.0, 1.0)


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


def written(picture: Picture, top: Sequence[str], bottom: Sequence[str]) -> NDArray[np.uint8]:
    """The picture in bytes, with lines in its upper and its lower left corner."""
    image = Image.fromarray(np.rint(255.0 * np.clip(picture, 0.0, 1.0)).astype(np.uint8))
    draw = ImageDraw.Draw(image)
    low = TEXT_MARGIN, image.height - TEXT_MARGIN
    draw.multiline_text((TEXT_MARGIN, TEXT_MARGIN), "\n".join(top), INK, font_size=TEXT_SIZE)
    draw.multiline_text(
        low, "\n".join(bottom), CAPTION_COLOUR, anchor="ld", font_size=TEXT_SIZE - 2
    )
    return np.asarray(image)
