"""Intrinsics and roll from synthetic pictures of a known camera."""

import dataclasses

import numpy as np
import pytest
from bolfi_liquids.hardware.vision import (
    CalibrationError,
    CameraModel,
    CharucoBoard,
    calibrate_intrinsics,
    level_camera,
    look_at,
)
from rendered_boards import render_board, render_plumb_line
from scipy.spatial.transform import Rotation

cv2 = pytest.importorskip("cv2")

BOARD = CharucoBoard()
TRUTH = CameraModel(
    focal=(652.0, 648.0),
    centre=(330.0, 233.0),
    size=(640, 480),
    rotation=np.eye(3),
    position=np.zeros(3),
    distortion=(-0.11, 0.06, 0.0008, -0.0006, 0.0),
)


def board_picture(turn, place, seed: int, board: CharucoBoard = BOARD) -> np.ndarray:
    """The board's middle at `place` [m] in the camera frame, turned by a rotation vector."""
    rotation = Rotation.from_rotvec(turn).as_matrix()
    middle = 0.5 * BOARD.square * np.array([BOARD.columns, BOARD.rows, 0.0])
    rng = np.random.default_rng(seed)
    return render_board(board, TRUTH, rotation, np.array(place) - rotation @ middle, rng)


def board_pictures(board: CharucoBoard) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    return [
        board_picture(
            rng.uniform([-0.5, -0.5, -0.2], [0.5, 0.5, 0.2]),
            rng.uniform([-0.08, -0.06, 0.28], [0.08, 0.06, 0.4]),
            seed,
            board,
        )
        for seed in range(12)
    ]


@pytest.fixture(scope="module")
def pictures() -> list[np.ndarray]:
    return board_pictures(BOARD)


def test_the_calibrated_lens_maps_the_picture_like_the_true_one(pictures):
    found = calibrate_intrinsics(pictures, BOARD)
    np.testing.assert_allclose(found.focal, TRUTH.focal, rtol=5e-3)
    np.testing.assert_allclose(found.centre, TRUTH.centre, atol=3.0)
    assert (found.views, found.legacy) == (12, False)
    assert found.rms < 0.4 and max(found.focal_error) < 3.0
    columns, rows = np.meshgrid(np.linspace(60, 580, 9), np.linspace(50, 430, 7))
    pixels = np.stack([columns, rows], axis=-1)
    seen, lens = TRUTH.undistort(pixels), found.placed(np.eye(3), np.zeros(3))
    apart = lens.project(np.concatenate([seen, np.ones((*seen.shape[:-1], 1))], axis=-1)) - pixels
    apart -= apart.mean(axis=(0, 1))  # a shifted centre is a turned camera
    assert np.abs(apart).max() < 1.5


@pytest.mark.slow
def test_a_board_of_the_older_pattern_is_read_and_told():
    """Most boards that were printed before 2022, of an even number of rows."""
    older = dataclasses.replace(BOARD, legacy=True)
    assert (older.print_image() != BOARD.print_image()).any()
    seen = board_pictures(older)
    found = calibrate_intrinsics(seen, BOARD)
    assert found.legacy and found.views == 12 and found.rms < 0.4
    np.testing.assert_allclose(found.focal, TRUTH.focal, rtol=5e-3)
    again = calibrate_intrinsics(seen, older)
    assert again == found


def test_pictures_that_do_not_determine_the_camera_are_refused(pictures):
    blank, rng = [np.full((480, 640), 128, np.uint8)] * 6, np.random.default_rng(3)
    alike = [
        board_picture((0.0, 0.0, 0.1 * k), (0.01 * k - 0.04, 0.0, 0.3), seed=k) for k in range(9)
    ]
    far = [board_picture(rng.uniform(-0.4, 0.4, 3), (0.0, 0.0, 0.5), seed=k) for k in range(9)]
    for given, told in (
        ([], "got 0"),
        ([pictures[0], pictures[1][:240]], "one size"),
        (pictures[:5] + blank, "5 of 11 pictures"),
        (alike, "alike"),
        (far, "corners"),
    ):
        with pytest.raises(CalibrationError, match=told):
            calibrate_intrinsics(given, BOARD)


POSITION = np.array([0.01, -0.45, 0.2])
TARGET = np.array([0.0, 0.0, 0.12])


def rolled(roll_deg: float) -> CameraModel:
    return dataclasses.replace(
        TRUTH,
        rotation=look_at(POSITION, TARGET, np.radians(roll_deg)),
        position=POSITION,
    )


@pytest.mark.parametrize(("roll_deg", "x"), [(0.0, 0.0), (1.5, 0.05), (-4.0, -0.08)])
def test_roll_is_right_to_a_twentieth_of_a_degree(roll_deg, x):
    rng = np.random.default_rng(0)
    image = render_plumb_line(rolled(roll_deg), np.array([x, 0.02, 0.4]), 0.5, 0.001, rng)
    found = level_camera(image, rolled(0.0), width=3.0)
    assert np.degrees(found.roll) == pytest.approx(roll_deg, abs=0.05)
    assert np.degrees(found.error) < 0.02
    np.testing.assert_allclose(found.camera.rotation, rolled(roll_deg).rotation, atol=1e-3)


def test_pictures_without_a_plumb_line_are_refused():
    empty = np.random.default_rng(0).normal(190, 3, (480, 640)).astype(np.uint8)
    with pytest.raises(CalibrationError, match="no plumb line"):
        level_camera(empty, rolled(0.0))
    short = empty.copy()
    short[:150, 300:304] = 30
    with pytest.raises(CalibrationError):
        level_camera(short, rolled(0.0))
    with pytest.raises(CalibrationError, match="shape"):
        level_camera(empty[:240], rolled(0.0))
