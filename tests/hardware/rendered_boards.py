"""Synthetic pictures for calibration: a ChArUco board, and a plumb line."""

import numpy as np
from bolfi_liquids.hardware.rendering.drawing import bar_coverage, blend, noise_pool, window_around
from bolfi_liquids.hardware.vision.calibration import CharucoBoard
from bolfi_liquids.hardware.vision.camera_model import CameraModel, opencv

SUPER_SAMPLING = 3
SQUARE_PIXELS = 60
BACKGROUND = 150.0
INK, PAPER = 30.0, 220.0


def render_board(
    board: CharucoBoard,
    camera: CameraModel,
    rotation: np.ndarray,
    position: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """Picture of a board, by looking up every pixel's ray on the board.

    Args:
        board: Its sizes.
        camera: That looks; only its intrinsics count.
        rotation: From the board's axes to the camera's, shape (3, 3).
        position: Of the board's first corner in the camera frame [m], shape (3,).
        rng: For the noise.

    Returns:
        Grey levels, uint8, shape (height, width).
    """
    cv2 = opencv()
    places = _on_board(camera, rotation, position) / board.square * SQUARE_PIXELS - 0.5
    printed = board.print_image(SQUARE_PIXELS).astype(np.float32)
    picture = cv2.remap(
        INK + printed * ((PAPER - INK) / 255.0),
        places[..., 0].astype(np.float32),
        places[..., 1].astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=BACKGROUND,
    )
    picture = cv2.resize(picture, camera.size, interpolation=cv2.INTER_AREA)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.6).astype(np.uint8)
    return noise_pool(camera.size, 2.0, 0.02, int(rng.integers(2**31))).add(picture, rng)


def _on_board(camera: CameraModel, rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Points of the board's plane [m] that sub-pixels see, shape (rows, columns, 2)."""
    width, height = camera.size
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1)
    rays = np.concatenate([camera.undistort(pixels), np.ones((*pixels.shape[:2], 1))], axis=-1)
    towards, start = rays @ rotation, position @ rotation
    # behind the camera there is no board
    depth = start[2] / np.where(towards[..., 2] * start[2] > 0, towards[..., 2], np.inf)
    places = depth[..., None] * towards[..., :2] - start[:2]
    size = (width * SUPER_SAMPLING, height * SUPER_SAMPLING)
    return opencv().resize(places, size, interpolation=opencv().INTER_LINEAR)


def render_plumb_line(
    camera: CameraModel, top: np.ndarray, length: float, radius: float, rng: np.random.Generator
) -> np.ndarray:
    """Picture of a thread that hangs straight down.

    Args:
        camera: That looks.
        top: Upper end in the cup frame [m], shape (3,).
        length: Of the thread [m].
        radius: Of the thread [m].
        rng: For the noise.

    Returns:
        Grey levels, uint8, shape (height, width).
    """
    image = np.full(camera.size[::-1], np.uint8(BACKGROUND + 40.0))
    points = top - np.outer(np.linspace(0.0, length, 9), [0.0, 0.0, 1.0])
    aside = radius * camera.rotation[0]
    sides = np.stack([camera.project(points + aside), camera.project(points - aside)])
    window = window_around(sides.reshape(-1, 2), camera.size)
    blend(image, window, bar_coverage(sides, window), INK)
    image = opencv().GaussianBlur(image, (5, 5), 0.8)
    return noise_pool(camera.size, 2.0, 0.02, int(rng.integers(2**31))).add(image, rng)
