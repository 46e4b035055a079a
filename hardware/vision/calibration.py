"""Calibration of a camera: its lens by pictures of a ChArUco board, its roll by a plumb line."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from .camera_model import CameraModel, opencv
from .stick_line import Line, Ray, Rows, fit_line, sampled_rows, search_rays

LEAST_VIEWS = 8
LEAST_CORNERS = 8
LEAST_TILT = np.radians(15.0)
LEAST_COVERAGE = 0.5  # of the picture's width and of its height
MOST_RMS = 1.0  # px
DARK = -1.0  # sign of the thread's contrast
LEAST_RESPONSE = 8.0  # grey levels
START_STEP = 3.0  # px
SEARCH_WIDTH = 9  # px
FLANK_WIDTH = 6  # px beside the thread that show the background
LEAST_SHARE = 0.5  # of the rows
MOST_ERROR = np.radians(0.2)


class CalibrationError(ValueError):
    """The pictures do not determine the camera; the message says what to do better."""


@dataclass(frozen=True)
class CharucoBoard:
    """A printed ChArUco board, markers of OpenCV's dictionary 5X5_100.

    Attributes:
        columns, rows: Number of squares.
        square: Side of a square, as measured on the print [m].
        marker: Side of a marker [m].
        legacy: Whether the pattern is that of OpenCV before version 4.6 (2022), which with an even
            number of rows has a marker in its first square.
    """

    columns: int = 8
    rows: int = 6
    square: float = 0.025
    marker: float = 0.018
    legacy: bool = False

    def opencv_board(self) -> Any:
        """The same as OpenCV's `CharucoBoard`."""
        aruco = opencv().aruco
        words = aruco.getPredefinedDictionary(aruco.DICT_5X5_100)
        board = aruco.CharucoBoard((self.columns, self.rows), self.square, self.marker, words)
        board.setLegacyPattern(self.legacy)
        return board

    def print_image(self, square_pixels: int = 100) -> np.ndarray:
        """The board to be printed, uint8, with no margin."""
        size = (self.columns * square_pixels, self.rows * square_pixels)
        return self.opencv_board().generateImage(size, marginSize=0)


class Intrinsics(NamedTuple):
    """Lens of a camera by its calibration.

    Attributes:
        focal: fx and fy [px].
        centre: cx and cy [px].
        size: Width and height of the pictures [px].
        distortion: k1, k2, p1, p2, k3.
        rms: Root mean square distance between corners seen and corners expected [px].
        focal_error: Standard errors of `focal` [px].
        views: Number of pictures used.
        legacy: Whether the board's pattern was found to be the older one, see `CharucoBoard`.
    """

    focal: tuple[float, float]
    centre: tuple[float, float]
    size: tuple[int, int]
    distortion: tuple[float, ...]
    rms: float
    focal_error: tuple[float, float]
    views: int
    legacy: bool = False

    def placed(self, rotation: np.ndarray, position: np.ndarray) -> CameraModel:
        """The camera with these intrinsics at a pose; see `look_at`."""
        return CameraModel(
            focal=self.focal,
            centre=self.centre,
            size=self.size,
            rotation=rotation,
            position=position,
            distortion=self.distortion,
        )


class _View(NamedTuple):
    on_board: np.ndarray  # (N, 1, 3) m
    pixels: np.ndarray  # (N, 1, 2)


def calibrate_intrinsics(images: Sequence[np.ndarray], board: CharucoBoard) -> Intrinsics:
    """Focal lengths, centre and distortion from pictures of a board.

    Both patterns of boards are tried, that of `board` first. Pictures with fewer than 8 corners are
    left out. The sixth-order distortion k3 stays 0: a
    webcam does not need it, and few pictures do not determine it.

    Args:
        images: Grey levels, uint8, all of one size.
        board: The printed board.

    Raises:
        CalibrationError: fewer than 8 pictures show enough of the board, all show it from the
            same side, they cover too little of the picture, or the fit is bad.
    """
    sizes = {image.shape for image in images}
    if len(sizes) != 1:
        raise CalibrationError(
            f"the pictures must be one or more and of one size, got {len(images)} of sizes "
            f"{sorted(sizes)}"
        )
    height, width = sizes.pop()
    legacy, views = _views(images, board)
    if len(views) < LEAST_VIEWS:
        raise CalibrationError(
            f"{len(views)} of {len(images)} pictures show at least {LEAST_CORNERS} corners of the "
            f"board, of the older pattern or the newer; {LEAST_VIEWS} such pictures are needed. "
            f"Is it a board of {board.columns} x {board.rows} squares, as --print-board makes? "
            "Hold it near, flat, lit and still"
        )
    _check_coverage(views, (width, height))
    intrinsics, turns = _solve(views, (width, height))
    _check_tilt(turns)
    if intrinsics.rms > MOST_RMS:
        raise CalibrationError(
            f"the corners lie {intrinsics.rms:.2f} px from where they should, more than "
            f"{MOST_RMS} px: is the board flat, and are its squares {1e3 * board.square:.1f} mm?"
        )
    return intrinsics._replace(legacy=legacy)


def _views(images: Sequence[np.ndarray], board: CharucoBoard) -> tuple[bool, list[_View]]:
    """Whether the older pattern is seen in more pictures, and those that show enough of it."""
    found: dict[bool, list[_View]] = {}
    for legacy in (board.legacy, not board.legacy):
        printed = replace(board, legacy=legacy)
        seen = [_corners(image, printed) for image in images]
        found[legacy] = [view for view in seen if view is not None]
        if len(found[legacy]) >= LEAST_VIEWS:
            break
    best = max(found, key=lambda legacy: len(found[legacy]))
    return best, found[best]


def _corners(image: np.ndarray, board: CharucoBoard) -> _View | None:
    printed = board.opencv_board()
    corners, ids, _, _ = opencv().aruco.CharucoDetector(printed).detectBoard(image)
    if ids is None or len(ids) < LEAST_CORNERS:
        return None
    on_board, pixels = printed.matchImagePoints(corners, ids)
    return _View(np.asarray(on_board, np.float32), np.asarray(pixels, np.float32))


def _solve(views: list[_View], size: tuple[int, int]) -> tuple[Intrinsics, np.ndarray]:
    """Intrinsics, and the board's rotation vectors [rad] in each view, shape (N, 3)."""
    cv2 = opencv()
    rms, matrix, distortion, turns, _, errors, _, _ = cv2.calibrateCameraExtended(
        [view.on_board for view in views],
        [view.pixels for view in views],
        size,
        None,
        None,
        flags=cv2.CALIB_FIX_K3,
    )
    k = [float(value) for value in np.ravel(distortion)[:5]]
    spread = np.ravel(errors)
    intrinsics = Intrinsics(
        focal=(float(matrix[0, 0]), float(matrix[1, 1])),
        centre=(float(matrix[0, 2]), float(matrix[1, 2])),
        size=size,
        distortion=tuple(k),
        rms=float(rms),
        focal_error=(float(spread[0]), float(spread[1])),
        views=len(views),
    )
    return intrinsics, np.array([np.ravel(turn) for turn in turns])


def _check_coverage(views: list[_View], size: tuple[int, int]) -> None:
    pixels = np.concatenate([view.pixels[:, 0] for view in views])
    covered = np.ptp(pixels, axis=0) / size
    if (covered < LEAST_COVERAGE).any():
        raise CalibrationError(
            f"the board was seen in {covered[0]:.0%} of the picture's width and {covered[1]:.0%} "
            f"of its height; at least {LEAST_COVERAGE:.0%} are needed. Move it into the corners"
        )


def _check_tilt(turns: np.ndarray) -> None:
    """Views must differ in tilt: else distance and focal length cannot be told apart."""
    normals = np.stack([opencv().Rodrigues(turn)[0][:, 2] for turn in turns])
    apart = float(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0)).max())
    if apart < LEAST_TILT:
        raise CalibrationError(
            f"all views of the board are alike: their tilts differ by {np.degrees(apart):.0f} "
            f"degrees at most, {np.degrees(LEAST_TILT):.0f} are needed. Tilt the board to the "
            "left, right, up and down by about 30 degrees"
        )


class Levelled(NamedTuple):
    """A camera put right by a plumb line.

    Attributes:
        camera: With corrected orientation.
        roll: By which the camera was found to be rolled, against its model, clockwise as the
            camera sees it [rad].
        error: Standard error [rad].
    """

    camera: CameraModel
    roll: float
    error: float


def level_camera(image: np.ndarray, camera: CameraModel, *, width: float = 4.0) -> Levelled:
    """Roll a camera about its line of sight so that a plumb line is vertical.

    Args:
        image: Grey levels, uint8; a thread hangs through most of its height, in front of an even
            background that is brighter.
        camera: Whose pitch and yaw are right or nearly so.
        width: Of the thread [px], about.

    Raises:
        CalibrationError: there is no thread, or too little of it.
    """
    from scipy.spatial.transform import Rotation

    if image.shape != camera.size[::-1]:
        raise CalibrationError(
            f"the picture has shape {image.shape}, the camera model {camera.size[::-1]}"
        )
    line = _thread(image, camera, width)
    roll = -_correction(line, camera)
    turned = replace(camera, rotation=Rotation.from_euler("z", -roll).as_matrix() @ camera.rotation)
    return Levelled(turned, roll, line.slope_error / (1.0 + line.slope**2))


def _correction(line: Line, camera: CameraModel) -> float:
    """Angle about the line of sight that turns the model's vertical into the line's plane.

    With the plane's normal n and the vertical g, both in the camera frame, n . Rz(angle) g = 0.
    """
    normal = np.array([1.0, -line.slope, -line.offset])
    down = camera.rotation @ [0.0, 0.0, -1.0]
    a = normal[0] * down[0] + normal[1] * down[1]
    b = normal[1] * down[0] - normal[0] * down[1]
    c = normal[2] * down[2]
    size = float(np.hypot(a, b))
    if not size > abs(c):
        raise CalibrationError("the camera looks straight up or down: a plumb line shows no roll")
    # a cos + b sin = -c has two roots; the other one is upside down
    middle, half = np.arctan2(b, a), np.arccos(-c / size)
    roots = (np.array([middle - half, middle + half]) + np.pi) % (2 * np.pi) - np.pi
    return float(roots[np.argmin(np.abs(roots))])


def _thread(image: np.ndarray, camera: CameraModel, width: float) -> Line:
    rows = Rows(0, image.shape[0])
    starts = np.arange(0.0, image.shape[1], START_STEP)
    # blurred to a width that the rays cannot step over
    smooth = opencv().blur(image, (SEARCH_WIDTH, 3))
    lines, middle = sampled_rows(smooth, DARK, rows), 0.5 * image.shape[0]
    far = 2.0 * image.shape[0]
    ray = search_rays(lines, starts, middle, rows, width=SEARCH_WIDTH, length=far)
    if ray.response < LEAST_RESPONSE:
        raise CalibrationError(
            "no plumb line was found: hang a thread, dark before a bright background, through "
            "the whole picture"
        )
    points = _centroids(image, ray, width)
    line = fit_line(camera.undistort(points))
    count = int(line.inlier.sum())
    if count < LEAST_SHARE * image.shape[0] or line.slope_error > MOST_ERROR:
        raise CalibrationError(
            f"the plumb line is seen in {count} of {image.shape[0]} rows; it must be straight and "
            "free over at least half of them"
        )
    return line


def _centroids(image: np.ndarray, ray: Ray, width: float) -> np.ndarray:
    """Middle of the thread in each row [px], shape (N, 2), where it stands out."""
    row = np.arange(image.shape[0])
    reach = int(np.ceil(0.5 * width + FLANK_WIDTH))
    centre = np.rint(ray.column + ray.slope * (row - ray.row)).astype(np.intp)
    inside = (centre >= reach) & (centre < image.shape[1] - reach)
    row, centre = row[inside], centre[inside]
    offsets = np.arange(-reach, reach + 1)
    strength = DARK * image[row[:, None], centre[:, None] + offsets].astype(np.float64)
    flank = np.abs(offsets) > reach - FLANK_WIDTH // 2
    level, scatter = strength[:, flank].mean(axis=1), strength[:, flank].std(axis=1)
    above = np.maximum(strength - level[:, None] - 2.0 * np.median(scatter), 0.0)
    mass = above.sum(axis=1)
    clear = mass > 0.3 * np.median(mass) if len(mass) else mass > 0
    middle = centre[clear] + (above @ offsets)[clear] / mass[clear]
    return np.column_stack([middle, row[clear]])
