"""The camera model, against OpenCV's own functions."""

import numpy as np
import pytest
from bolfi_liquids.hardware.vision import (
    CameraModel,
    CameraModelError,
    look_at,
    read_camera,
    write_camera,
)

pytest.importorskip("cv2")

BENT = (-0.21, 0.08, 0.0012, -0.0009, -0.01)


def camera(**changes) -> CameraModel:
    position = np.array([0.05, -0.5, 0.2])
    fields = {
        "focal": (652.0, 648.0),
        "centre": (330.0, 233.0),
        "size": (640, 480),
        "rotation": look_at(position, np.array([0.0, 0.0, 0.12]), np.radians(2.0)),
        "position": position,
        "distortion": BENT,
    }
    return CameraModel(**{**fields, **changes})


def test_projection_is_that_of_the_model_of_brown_and_conrady():
    one, rng = camera(), np.random.default_rng(0)
    points = rng.uniform([-0.15, -0.15, 0.0], [0.15, 0.15, 0.25], (200, 3))
    across, down, ahead = one.rotation @ (points - one.position).T
    x, y, (k1, k2, p1, p2, k3) = across / ahead, down / ahead, BENT
    square = x**2 + y**2
    radial = 1.0 + k1 * square + k2 * square**2 + k3 * square**3
    bent_x = x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x**2)
    bent_y = y * radial + 2.0 * p2 * x * y + p1 * (square + 2.0 * y**2)
    expected = np.stack([652.0 * bent_x + 330.0, 648.0 * bent_y + 233.0], axis=-1)
    np.testing.assert_allclose(one.project(points), expected, atol=1e-9)


def test_undistort_is_the_inverse_of_the_distortion_over_the_whole_picture():
    one = camera()
    columns, rows = np.meshgrid(np.linspace(0, 639, 30), np.linspace(0, 479, 20))
    pixels = np.stack([columns, rows], axis=-1)
    seen = one.undistort(pixels)
    rays = np.concatenate([seen, np.ones((*seen.shape[:-1], 1))], axis=-1) @ one.rotation
    np.testing.assert_allclose(one.project(one.position + 0.3 * rays), pixels, atol=1e-4)


def test_views_have_the_axes_of_the_contract():
    for position, right in (((0.0, -0.5, 0.1), (1, 0, 0)), ((0.5, 0.0, 0.1), (0, 1, 0))):
        rotation = look_at(np.array(position), np.array([0.0, 0.0, 0.1]))
        forward = -np.array(position) * [1, 1, 0] / 0.5
        np.testing.assert_allclose(rotation, [right, (0, 0, -1), forward], atol=1e-12)


def test_a_camera_rolled_clockwise_sees_upright_things_lean_to_the_left():
    position = np.array([0.0, -0.5, 0.1])
    rolled = camera(
        position=position,
        rotation=look_at(position, np.array([0.0, 0.0, 0.1]), np.radians(5.0)),
        distortion=(0.0,) * 5,
    )
    low, high = rolled.project(np.array([[0.0, 0.0, 0.05], [0.0, 0.0, 0.15]]))
    across, up = (high - low) / rolled.focal * [1, -1]
    assert np.degrees(np.arctan2(across, up)) == pytest.approx(-5.0, abs=1e-9)


def test_place_is_the_inverse_of_project():
    one, point = camera(), np.array([0.02, 0.03, 0.15])
    pixel = one.project(point[None])[0]
    np.testing.assert_allclose(one.place(pixel, one.depth(point)), point, atol=1e-9)
    behind = np.array([[0.05, -0.6, 0.2]])
    assert np.isnan(one.project(behind)).all()


def test_a_file_gives_the_same_camera_back(tmp_path):
    one = camera()
    write_camera(one, tmp_path / "camera_xz.json")
    again = read_camera(tmp_path / "camera_xz.json")
    point = np.array([[0.01, 0.02, 0.15]])
    np.testing.assert_array_equal(again.project(point), one.project(point))
    assert again.size == one.size


def test_a_file_that_is_no_camera_is_named(tmp_path):
    path = tmp_path / "camera_xz.json"
    for text in ("no json", "{}", '{"focal": [1, 2]}', "[1]"):
        path.write_text(text)
        with pytest.raises(CameraModelError, match=r"camera_xz\.json"):
            read_camera(path)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("focal", (0.0, 640.0)),
        ("focal", (640.0, "wide")),
        ("focal", 640.0),
        ("size", None),
        ("size", ((640,), (480, 3))),
        ("position", np.array([0.0, np.nan, 0.0])),
        ("rotation", np.diag([1.0, 1.0, -1.0])),
        ("rotation", np.eye(2)),
        ("distortion", (0.1,)),
    ],
)
def test_impossible_cameras_are_refused(name, value):
    with pytest.raises(CameraModelError, match=f"the camera's {name} "):
        camera(**{name: value})


def test_a_camera_cannot_look_straight_down():
    with pytest.raises(CameraModelError):
        look_at(np.array([0.0, 0.0, 1.0]), np.zeros(3))
