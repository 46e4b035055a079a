"""A camera calibrated by the command, from pictures of a lens and a roll that are known."""

import dataclasses
import errno
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.vision import CharucoBoard
from bolfi_liquids.hardware.vision.stick_view import camera_model
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from bolfi_liquids.cli.app import app
from bolfi_liquids.robot.camera_calibration import write_board

sys.path.append(str(Path(__file__).parents[2] / "hardware"))
from rendered_boards import render_board, render_plumb_line  # noqa: E402

cv2 = pytest.importorskip("cv2")

ROLL_DEG = 1.5
FOCAL = (780.0, 776.0)


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """A directory of boards, and a plumb line, as the rig's camera xz with another lens sees."""
    folder, rng, board = (
        tmp_path_factory.mktemp("pictures"),
        np.random.default_rng(1),
        CharucoBoard(),
    )
    rolled = bundled_rig().camera("xz").model_copy(update={"roll_deg": ROLL_DEG})
    camera = dataclasses.replace(camera_model(rolled), focal=FOCAL)
    middle = 0.5 * board.square * np.array([board.columns, board.rows, 0.0])
    (folder / "boards").mkdir()
    for k in range(12):
        turn = rng.uniform([-0.5, -0.5, -0.2], [0.5, 0.5, 0.2])
        place = rng.uniform([-0.08, -0.06, 0.33], [0.08, 0.06, 0.47])
        turned = Rotation.from_rotvec(turn).as_matrix()
        image = render_board(board, camera, turned, place - turned @ middle, rng)
        cv2.imwrite(str(folder / "boards" / f"{k}.png"), image)
    thread = render_plumb_line(camera, np.array([0.02, 0.02, 0.4]), 0.5, 0.001, rng)
    cv2.imwrite(str(folder / "plumb.png"), thread)
    return folder


def test_the_lens_is_written_and_the_roll_told(pictures, tmp_path):
    lens = tmp_path / "lens.json"
    command = ["rig", "calibrate-cameras", "--boards", str(pictures / "boards"), "--out", str(lens)]
    done = CliRunner().invoke(app, [*command, "--plumb-line", str(pictures / "plumb.png")])
    assert done.exit_code == 0, done.stderr
    np.testing.assert_allclose(json.loads(lens.read_text())["focal"], FOCAL, rtol=5e-3)
    told = re.search(r"roll_deg = (\S+)", done.stdout)
    assert told is not None and float(told[1]) == pytest.approx(ROLL_DEG, abs=0.1)
    assert f'intrinsics = "{lens.name}"' in done.stdout


def test_a_plumb_line_alone_keeps_the_lens(pictures, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = ["rig", "calibrate-cameras", "--plumb-line", str(pictures / "plumb.png")]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0 and "roll_deg = " in done.stdout
    assert list(tmp_path.iterdir()) == []


def test_the_board_is_written_whole_or_it_is_an_error(tmp_path, monkeypatch):
    made = write_board(tmp_path / "board.PNG")
    np.testing.assert_array_equal(cv2.imread(str(made), 0), CharucoBoard().print_image())

    def full(*_):
        raise OSError(errno.ENOSPC, "no space")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match=r"other\.png"):
        write_board(tmp_path / "other.png")
    assert [one.name for one in tmp_path.iterdir()] == ["board.PNG"]


def test_what_cannot_be_used_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = {"--view": "xy", "--square": "0.1", "--boards": "nowhere", "--plumb-line": "gone.png"}
    for option, value in rows.items():
        done = CliRunner().invoke(app, ["rig", "calibrate-cameras", option, value])
        assert done.exit_code == 2 and (option in done.stderr or value in done.stderr)
