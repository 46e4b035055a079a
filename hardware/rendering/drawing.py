"""Pictures of the scene as a camera would take them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..vision.camera_model import CameraModel, opencv
from ..vision.stick_view import Scene, circle
from .world import WorldState, direction

SUBPIXEL_BITS = 4  # OpenCV draws at sixteenths of a pixel
SUB_EXPOSURES = 3


@dataclass(frozen=True)
class Look:
    """Look of a picture; grey levels are 0 to 255.

    Attributes:
        background: Mean grey level behind everything.
        clutter: Standard deviation of the background's smooth texture.
        stick, liquid, gripper, marker, glass: Grey levels.
        exposure: Time over which a moving thing is smeared [s].
        defocus: Standard deviation of the lens's blur [px].
        read_noise: Standard deviation of the noise in the dark.
        shot_noise: Variance per grey level.
    """

    background: float = 190.0
    clutter: float = 6.0
    stick: float = 45.0
    liquid: float = 150.0
    gripper: float = 60.0
    marker: float = 235.0
    glass: float = 120.0
    exposure: float = 0.008
    defocus: float = 0.8
    read_noise: float = 2.0
    shot_noise: float = 0.05


BRIGHT_STICK = Look(background=50.0, stick=210.0, liquid=90.0, gripper=30.0)


@dataclass(frozen=True, eq=False)
class PixelNoise:
    """Read and shot noise from a pool of normal numbers, cut out at a random place each time.

    Attributes:
        pool: Standard normal, float32, larger than the picture.
        strength: Standard deviation at each grey level, float32, shape (256,).
    """

    pool: np.ndarray
    strength: np.ndarray

    def add(self, image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """A noisy copy of a picture."""
        cv2 = opencv()
        height, width = image.shape
        top = int(rng.integers(self.pool.shape[0] - height + 1))
        left = int(rng.integers(self.pool.shape[1] - width + 1))
        field = self.pool[top : top + height, left : left + width]
        noisy = cv2.multiply(cv2.LUT(image, self.strength), field)
        return cv2.add(image, noisy, dtype=cv2.CV_8U)


def noise_pool(size: tuple[int, int], read: float, shot: float, seed: int) -> PixelNoise:
    """Prepare noise for pictures of `size` (width, height).

    Args:
        size: Of the pictures [px].
        read: Standard deviation at grey level 0.
        shot: Variance per grey level.
        seed: Of the pool.
    """
    rng = np.random.default_rng(seed)
    pool = rng.standard_normal((size[1] + 397, size[0] + 499), dtype=np.float32)
    return PixelNoise(pool, np.sqrt(read**2 + shot * np.arange(256)).astype(np.float32))


class PixelWindow(NamedTuple):
    """A part of the picture: rows and columns from the first to before the last."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def empty(self) -> bool:
        """Whether it holds no pixel."""
        return self.bottom <= self.top or self.right <= self.left


def window_around(points: np.ndarray, size: tuple[int, int], margin: float = 2.0) -> PixelWindow:
    """The part of a picture of `size` (width, height) that holds points [px], shape (N, 2)."""
    if not np.isfinite(points).all():
        return PixelWindow(0, 0, 0, 0)
    left, top = np.floor(points.min(axis=0) - margin)
    right, bottom = np.ceil(points.max(axis=0) + margin) + 1
    width, height = size
    return PixelWindow(
        int(np.clip(top, 0, height)),
        int(np.clip(bottom, 0, height)),
        int(np.clip(left, 0, width)),
        int(np.clip(right, 0, width)),
    )


def bar_coverage(sides: np.ndarray, window: PixelWindow) -> np.ndarray:
    """Covered share of each pixel of a window by a bar, float32.

    Exact for an edge along the pixel's sides, and for other directions of mean error zero, so
    that the middle between two edges is not shifted.

    Args:
        sides: Pixels along its two long sides, both from the same end, shape (2, K, 2); a lens
            that distorts bends them, so K is 2 or, for bent ones, at least 5.
        window: Where to evaluate.
    """
    # towards the other side, not to the bar's middle: a thin bent bar bends past its chord
    across, along = sides[1].mean(axis=0) - sides[0].mean(axis=0), sides[0, -1] - sides[0, 0]
    inside = [_half_plane(sides[0], across, window), _half_plane(sides[1], -across, window)]
    ends = [_half_plane(sides[:, 0], along, window), _half_plane(sides[:, -1], -along, window)]
    return np.maximum(inside[0] + inside[1] - 1.0, 0.0) * ends[0] * ends[1]


def _half_plane(edge: np.ndarray, inwards: np.ndarray, window: PixelWindow) -> np.ndarray:
    """Covered share on the side of an edge, through points of shape (K, 2), that is inwards."""
    columns = np.arange(window.left, window.right)
    rows = np.arange(window.top, window.bottom)
    start, along = edge[0], edge[-1] - edge[0]
    length = max(float(np.hypot(*along)), 1e-9)
    normal = np.array([-along[1], along[0]]) / length
    if normal @ inwards < 0:
        normal = -normal
    distance = _outer_sum(rows * normal[1] + (0.5 - normal @ start), columns * normal[0])
    if len(edge) > 2:
        share = along / length**2
        place = _outer_sum(rows * share[1] - share @ start, columns * share[0])
        # a cubic through the bent edge is right to a hundredth of a pixel
        bend = np.polyfit((edge - start) @ share, (edge - start) @ normal, 3).astype(np.float32)
        distance -= ((bend[0] * place + bend[1]) * place + bend[2]) * place + bend[3]
    return np.clip(distance, 0.0, 1.0, out=distance)


def _outer_sum(down: np.ndarray, across: np.ndarray) -> np.ndarray:
    return np.add.outer(down.astype(np.float32), across.astype(np.float32))


def disc_coverage(centre: np.ndarray, radius: float, window: PixelWindow) -> np.ndarray:
    """Covered share of each pixel of a window by a disc [px], float32."""
    columns = np.arange(window.left, window.right, dtype=np.float32) - np.float32(centre[0])
    rows = np.arange(window.top, window.bottom, dtype=np.float32) - np.float32(centre[1])
    distance = np.hypot(rows[:, None], columns[None, :])
    return np.clip(radius + 0.5 - distance, 0.0, 1.0)


def blend(image: np.ndarray, window: PixelWindow, coverage: np.ndarray, grey: float) -> None:
    """Paint a grey level over a part of the picture, in place."""
    part = image[window.top : window.bottom, window.left : window.right]
    part[...] = np.rint(part + coverage * (np.float32(grey) - part)).astype(np.uint8)


def surface_share(state: WorldState, scene: Scene) -> float:
    """Share of the stick, from the pivot, at which its axis meets the surface; 1 if nowhere."""
    down = direction(state.inclination)
    reach = (scene.fill - state.pivot[2]) / (down[2] * scene.stick_length)
    entry = state.pivot + reach * scene.stick_length * down
    meets = 0.0 < reach < 1.0 and np.hypot(*entry[:2]) < scene.cup_radius
    return float(reach) if meets and scene.fill > 0 else 1.0


def bar_sides(state: WorldState, camera: CameraModel, scene: Scene, *, share: float) -> np.ndarray:
    """Both sides of the stick's outline from the pivot to a share of its length.

    The outline of a cylinder is where the planes through the lens touch it, which is exact in
    perspective too.

    Returns:
        Pixels, shape (2, K, 2), from the pivot down; K is 2, or more if the lens bends lines.
    """
    down = direction(state.inclination)
    sides = _touching_radii(state.pivot, down, camera.position, scene.stick_radius)
    points = 9 if any(camera.distortion) else 2
    axis = state.pivot + np.outer(np.linspace(0.0, share * scene.stick_length, points), down)
    return camera.project(axis[None] + sides[:, None])


def _touching_radii(
    pivot: np.ndarray, down: np.ndarray, eye: np.ndarray, radius: float
) -> np.ndarray:
    """Radii [m], shape (2, 3), from the axis to the two lines at which a view touches a rod."""
    towards = (eye - pivot) - ((eye - pivot) @ down) * down
    distance = float(np.linalg.norm(towards))
    towards = towards / distance
    aside = np.cross(down, towards)
    cosine = radius / distance
    sine = np.sqrt(1.0 - cosine**2)
    return radius * np.stack([cosine * towards + sine * aside, cosine * towards - sine * aside])


@dataclass(frozen=True, eq=False)
class Stage:
    """All that does not change from frame to frame.

    Attributes:
        scene: Sizes.
        camera: That looks.
        look: Of the picture.
        backdrop: The picture without gripper and stick.
        glass: Lines of the cup in front of the stick, each pixels of shape (N, 2).
        noise: To be added.
    """

    scene: Scene
    camera: CameraModel
    look: Look
    backdrop: np.ndarray
    glass: tuple[np.ndarray, ...]
    noise: PixelNoise


def prepare(scene: Scene, camera: CameraModel, look: Look, seed: int = 0) -> Stage:
    """Draw what stands still and make ready what every frame needs."""
    backdrop = _background(camera.size, look, np.random.default_rng(seed))
    if scene.fill > 0:
        _draw_liquid(backdrop, scene, camera, look)
    glass = _glass_lines(scene, camera)
    _draw_lines(backdrop, _back_lines(scene, camera), look.glass)
    noise = noise_pool(camera.size, look.read_noise, look.shot_noise, seed + 1)
    return Stage(scene, camera, look, backdrop, glass, noise)


def render(stage: Stage, exposures: Sequence[WorldState], rng: np.random.Generator) -> np.ndarray:
    """One picture: `draw`, then `develop`."""
    return develop(stage, draw(stage, exposures), rng)


def draw(stage: Stage, exposures: Sequence[WorldState]) -> np.ndarray:
    """Draw the picture of a perfect camera; the stick ends at the liquid's surface.

    Args:
        stage: What `prepare` made.
        exposures: The scene at equally spaced moments of the exposure; see `exposure_times`.

    Returns:
        Grey levels, uint8, shape (height, width).
    """
    image = stage.backdrop.copy()
    _draw_stick(image, stage, exposures)
    _draw_lines(image, stage.glass, stage.look.glass)
    _draw_gripper(image, stage, exposures[len(exposures) // 2])
    _draw_marker(image, stage, exposures)
    return image


def develop(stage: Stage, image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A drawn picture with the lens's blur and the sensor's noise."""
    look = stage.look
    if look.defocus > 0:
        image = opencv().GaussianBlur(image, (5, 5), look.defocus)
    return stage.noise.add(image, rng) if look.read_noise > 0 else image


def exposure_times(middle: float, look: Look) -> np.ndarray:
    """Moments [s] at which to ask for the scene, for an exposure about `middle`."""
    if look.exposure <= 0:
        return np.array([middle])
    steps = (np.arange(SUB_EXPOSURES) + 0.5) / SUB_EXPOSURES - 0.5
    return middle + look.exposure * steps


def _background(size: tuple[int, int], look: Look, rng: np.random.Generator) -> np.ndarray:
    width, height = size
    coarse = rng.standard_normal((8, 10)).astype(np.float32)
    texture = opencv().resize(coarse, (width, height), interpolation=opencv().INTER_CUBIC)
    slope = np.linspace(-1.0, 1.0, height, dtype=np.float32)[:, None]
    return np.clip(look.background + look.clutter * (texture + slope), 0, 255).astype(np.uint8)


def _draw_liquid(image: np.ndarray, scene: Scene, camera: CameraModel, look: Look) -> None:
    body = np.concatenate([circle(scene.cup_radius, 0.0), circle(scene.cup_radius, scene.fill)])
    hull = opencv().convexHull(camera.project(body).astype(np.float32))
    opencv().fillConvexPoly(image, fixed_point(hull[:, 0]), int(look.liquid), shift=SUBPIXEL_BITS)


def _glass_lines(scene: Scene, camera: CameraModel) -> tuple[np.ndarray, ...]:
    """The near half of the rim: it runs across the stick."""
    rim = circle(scene.cup_radius, scene.cup_height)
    near = rim[rim @ (camera.position * [1.0, 1.0, 0.0]) > 0]
    order = np.argsort(near @ camera.rotation[0])
    return (camera.project(near[order]),)


def _back_lines(scene: Scene, camera: CameraModel) -> tuple[np.ndarray, ...]:
    """Rim, floor, surface and the two sides of the cup."""
    heights = [0.0, scene.cup_height] + ([scene.fill] if scene.fill > 0 else [])
    rings = [circle(scene.cup_radius, height) for height in heights]
    side = scene.cup_radius * camera.rotation[0] * [1.0, 1.0, 0.0]
    top = np.array([0.0, 0.0, scene.cup_height])
    walls = [np.stack([sign * side, sign * side + top]) for sign in (-1.0, 1.0)]
    closed = [np.concatenate([ring, ring[:1]]) for ring in rings]
    return tuple(camera.project(line) for line in closed + walls)


def _draw_lines(image: np.ndarray, lines: Sequence[np.ndarray], grey: float) -> None:
    cv2 = opencv()
    fixed = [fixed_point(line) for line in lines]
    cv2.polylines(image, fixed, False, int(grey), 1, cv2.LINE_AA, SUBPIXEL_BITS)


def _draw_stick(image: np.ndarray, stage: Stage, exposures: Sequence[WorldState]) -> None:
    camera, scene = stage.camera, stage.scene
    sides = [
        bar_sides(state, camera, scene, share=surface_share(state, scene)) for state in exposures
    ]
    window = window_around(np.concatenate(sides).reshape(-1, 2), camera.size)
    if window.empty:
        return
    coverage = np.mean([bar_coverage(one, window) for one in sides], axis=0)
    blend(image, window, coverage, stage.look.stick)


def _draw_gripper(image: np.ndarray, stage: Stage, state: WorldState) -> None:
    scene, cv2 = stage.scene, opencv()
    half = scene.gripper_half_width
    corners = state.pivot + np.array(
        [
            [x, y, z]
            for x in (-half, half)
            for y in (-half, half)
            for z in (-scene.gripper_below, scene.gripper_above)
        ]
    )
    pixels = stage.camera.project(corners)
    if np.isfinite(pixels).all():
        hull = cv2.convexHull(pixels.astype(np.float32))[:, 0]
        cv2.fillConvexPoly(
            image, fixed_point(hull), int(stage.look.gripper), cv2.LINE_AA, SUBPIXEL_BITS
        )


def _draw_marker(image: np.ndarray, stage: Stage, exposures: Sequence[WorldState]) -> None:
    camera = stage.camera
    places = np.stack([state.pivot for state in exposures]) + stage.scene.marker_offset
    pixels = camera.project(places)
    radius = stage.scene.marker_radius * camera.focal[0] / camera.depth(places[0])
    window = window_around(pixels, camera.size, margin=radius + 2.0)
    if window.empty:
        return
    coverage = np.mean([disc_coverage(pixel, radius, window) for pixel in pixels], axis=0)
    blend(image, window, coverage, stage.look.marker)


def fixed_point(pixels: np.ndarray) -> np.ndarray:
    """Pixels as OpenCV's fixed-point numbers, shape (N, 1, 2)."""
    return np.rint(np.clip(pixels, -4e3, 4e3) * 2**SUBPIXEL_BITS).astype(np.int32)[:, None]
