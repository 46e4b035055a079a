"""What every camera must do: those of the package, the example's, and one of your own.

`pytest tests/extensions --camera your_module:YourCamera` adds the last to each test.
"""

import pickle
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.hardware import RigError, bundled_rig, webcams
from bolfi_liquids.hardware.cameras import (
    CameraError,
    FilesCamera,
    Frame,
    RenderedCamera,
    Timing,
    Webcam,
    open_camera,
)
from bolfi_liquids.hardware.rendering import Look, SharedWorld, WorldState, prepare
from bolfi_liquids.hardware.vision.stick_view import camera_model, scene

from .named import named

cv2 = pytest.importorskip("cv2")

RIG = bundled_rig()
SECTION = RIG.camera("xz")
EXAMPLE = f"{Path(__file__).with_name('pattern_camera.py')}:PatternCamera"
FILES = ("directory", "video")  # their times are their own, and they end
SIZE = (SECTION.width, SECTION.height)


def pytest_generate_tests(metafunc):
    if "camera" in metafunc.fixturenames:
        own = metafunc.config.getoption("camera", default="")
        names = [*FILES, "webcam", "rendered", "example", *([own] if own else [])]
        metafunc.parametrize("camera", names, indirect=True)


def video(folder):
    path = folder / "view.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 25.0, SIZE)
    for k in range(80):
        writer.write(np.full((*SIZE[::-1], 3), 3 * k, np.uint8))
    writer.release()
    return path


def rendered():
    world = SharedWorld(0.0, WorldState(0.0, np.array([0.0, 0.0, 0.235]), np.zeros(2)))
    stage = prepare(scene(RIG, "xz"), camera_model(SECTION), Look())
    return RenderedCamera(stage, world, Timing(rate=SECTION.rate))


@pytest.fixture
def camera(request, tmp_path):
    """An open camera, and its name."""
    name = request.param
    if name == "directory":
        for k in range(10):
            cv2.imwrite(str(tmp_path / f"{k}.png"), np.full(SIZE[::-1], 20 * k, np.uint8))
        opened = FilesCamera(tmp_path, rate=SECTION.rate)
    elif name == "video":
        opened = FilesCamera(video(tmp_path))
    elif name == "webcam":  # OpenCV opens a file like a device
        opened = Webcam(str(video(tmp_path)), size=SIZE)
    elif name == "rendered":
        opened = rendered()
    elif name == "example":
        opened = open_camera(SECTION.model_copy(update={"driver": EXAMPLE}))
    else:
        opened = named(name)(SECTION)
    yield opened, name
    opened.close()


def check_frames(frames, name, since):
    """Grey pictures of the section's size; their numbers and times rise."""
    for frame in frames:
        assert isinstance(frame, Frame) and isinstance(frame.index, int)
        assert isinstance(frame.stamp, float) and np.isfinite(frame.stamp)
        assert (frame.image.dtype, frame.image.shape) == (np.uint8, SIZE[::-1])
    assert frames[0].index >= 0
    assert (np.diff([frame.index for frame in frames]) >= 1).all()
    assert (np.diff([frame.stamp for frame in frames]) > 0.0).all()
    if name not in FILES:  # a picture is stamped when it comes, by this computer's clock
        assert since <= frames[0].stamp and frames[-1].stamp <= time.monotonic()


def test_frames_are_grey_pictures_whose_times_rise(camera):
    opened, name = camera
    since = time.monotonic() - 0.1
    frames = [opened.read() for _ in range(8)]
    check_frames(frames, name, since)
    kept = frames[0].image.copy()
    opened.read()
    # what was given is not written to any more
    np.testing.assert_array_equal(frames[0].image, kept)


def test_closing_is_harmless_when_repeated_and_then_there_is_no_picture(camera):
    opened, name = camera
    opened.close()
    opened.close()
    if name != "rendered":  # which holds nothing
        try:
            assert opened.read() is None
        except CameraError:
            pass


def test_a_camera_whose_clock_stands_still_is_noticed():
    frames = [Frame(k, 5.0, np.zeros(SIZE[::-1], np.uint8)) for k in range(3)]
    with pytest.raises(AssertionError):
        check_frames(frames, "directory", 0.0)


def test_a_rig_s_driver_is_opened_in_the_process_that_reads_it():
    """It is sent there by the name of its file."""
    cameras = tuple(one.model_copy(update={"driver": EXAMPLE}) for one in RIG.cameras)
    make = webcams(RIG.model_copy(update={"cameras": cameras}))["yz"]
    opened = pickle.loads(pickle.dumps(make))()
    assert opened.read().image.shape == SIZE[::-1]
    opened.close()


FAULTY = {
    "class Mine(": "SyntaxError: ",
    "1 / 0": "ZeroDivisionError: ",
    "import nowhere_at_all": "ModuleNotFoundError: No module named 'nowhere_at_all'",
    "raise ImportError('line\\nby line')": "ImportError: line by line",
    "class Mine:\n    pass": "TypeError: ",  # it is called with its section
    "class Mine:\n    def __init__(self, camera):\n        camera.serial": "AttributeError: ",
    "from bolfi_liquids.hardware.cameras import FrameSource\n"
    "class Mine(FrameSource):\n    def __init__(self, _): ...\n    def close(self): ...": "'read'",
}


def refusal(driver):
    with pytest.raises(RigError) as caught:
        open_camera(SECTION.model_copy(update={"driver": driver}))
    assert caught.value.where == "cameras: xz: driver" and driver in caught.value.what
    assert "\n" not in str(caught.value)
    return caught.value.what


def test_a_driver_that_is_none_is_named():
    for driver in ("nowhere.py:Camera", f"{EXAMPLE}s", "no_python.txt:C", "Camera"):
        refusal(driver)


@pytest.mark.parametrize("text", FAULTY)
def test_a_driver_that_does_not_work_is_named_with_what_is_wrong_in_it(tmp_path, text):
    (tmp_path / "mine.py").write_text(text)
    assert FAULTY[text] in refusal(f"{tmp_path / 'mine.py'}:Mine")


def test_a_driver_whose_camera_cannot_be_used_says_so_itself(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from bolfi_liquids.hardware.cameras import CameraError\n"
        "def mine(camera):\n    raise CameraError('unplugged')"
    )
    with pytest.raises(CameraError, match="unplugged"):
        open_camera(SECTION.model_copy(update={"driver": f"{tmp_path / 'mine.py'}:mine"}))


def test_without_opencv_the_extra_is_named(monkeypatch):
    from bolfi_liquids.hardware.vision.camera_model import opencv

    monkeypatch.setitem(sys.modules, "cv2", None)
    opencv.cache_clear()
    with pytest.raises(ImportError, match=r"bolfi-liquids\[cameras\]"):
        Webcam(0, size=SIZE)
    opencv.cache_clear()
