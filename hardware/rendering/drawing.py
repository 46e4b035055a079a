"""Pictures of the scene as a camera would take them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..vision.camera_model import CameraModel
from ..vision.opencv import opencv
from ..vision.stick_view import Scene, circle
from .coverage import bar_coverage, blend, disc_coverage, window_around
from .look import Look
from .noise import PixelNoise, noise_pool
from .stick_shape import bar_sides, surface_share
from .world import WorldState

SUBPIXEL_BITS = 4  # OpenCV draws at sixteenths of a pixel
SUB_EXPOSURES = 3


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
