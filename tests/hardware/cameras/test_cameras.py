"""Cameras: files and webcams by OpenCV on real files, rendered ones on a clock of the test."""

import csv
import dataclasses

import numpy as np
import pytest
from bolfi_liquids.hardware.cameras import (
    CameraError,
    FilesCamera,
    RenderedCamera,
    Timing,
    Webcam,
)
from bolfi_liquids.hardware.cameras.base import grey
from bolfi_liquids.hardware.rendering import prepare
from rendered_scenes import CLEAN, MovingWorld, rehearsal_camera, rehearsal_scene
from stepped_clock import SteppedClock

cv2 = pytest.importorskip("cv2")


def pictures(count: int, size=(64, 48)) -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    return [rng.integers(0, 255, size[::-1], dtype=np.uint8) for _ in range(count)]


@pytest.fixture
def video(tmp_path):
    path = tmp_path / "view.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (64, 48))
    for k in range(20):
        writer.write(np.full((48, 64, 3), 10 * k, np.uint8))
    writer.release()
    return path


@pytest.mark.parametrize(
    "names",
    [
        [f"{k:04d}.png" for k in range(12)],
        [f"Frame {k}.PNG" if k % 2 else f"frame {k}.png" for k in range(8, 12)],
        ["b2_9.png", "b2_10.png", "b10_1.png"],
    ],
)
def test_pictures_are_read_unchanged_in_the_order_of_the_numbers_in_their_names(tmp_path, names):
    images = pictures(len(names))
    for name, image in zip(names, images, strict=True):
        cv2.imwrite(str(tmp_path / name), image)
    # a hidden file is a note of the system about another
    for name in ("notes.txt", "._1.png", ".DS_Store"):
        (tmp_path / name).write_bytes(b"no picture")
    camera = FilesCamera(tmp_path, rate=20.0)
    for k, (frame, image) in enumerate(zip(iter(camera.read, None), images, strict=True)):
        assert (frame.index, frame.stamp) == (k, pytest.approx(k / 20.0))
        np.testing.assert_array_equal(frame.image, image)
    assert camera.read() is None


def test_a_video_has_its_own_times_and_becomes_grey(video):
    frames = list(iter(FilesCamera(video).read, None))
    assert len(frames) == 20
    np.testing.assert_allclose([f.stamp for f in frames], np.arange(20) / 25.0, atol=1e-6)
    assert frames[7].image.mean() == pytest.approx(70.0, abs=2.0)
    colour = np.zeros((1, 3, 3), np.uint8)
    colour[0, [0, 1, 2], [0, 1, 2]] = 200  # blue, green, red
    np.testing.assert_allclose(grey(colour)[0], [22.8, 117.4, 59.8], atol=0.6)


def test_nothing_to_read_is_refused_on_opening(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "one.png").write_bytes(b"no picture")
    for name in ("empty", "nowhere", "broken"):
        with pytest.raises(CameraError, match=name):
            FilesCamera(tmp_path / name)
    with pytest.raises(ValueError, match="rate"):
        FilesCamera(tmp_path, rate=0.0)


def test_a_webcam_skips_what_was_kept_and_says_when_it_stops(video):
    # OpenCV opens a file like a device: this tries all but the driver's settings
    camera = Webcam(str(video), size=(64, 48))
    first, second = camera.read(), camera.read()
    assert (first.index, second.index) == (5, 11)  # a file's pictures are all there at once
    with pytest.raises(CameraError, match=r"view\.avi"):
        for _ in range(100):
            camera.read()
    camera.close()


def test_a_webcam_of_another_size_and_one_that_is_not_there_are_named(video, tmp_path):
    for path, size in ((video, (640, 480)), (tmp_path / "no_camera", (64, 48))):
        with pytest.raises(CameraError, match=path.name):
            Webcam(str(path), size=size)


class Capture:
    """A driver that takes a picture each 20 ms and keeps three; with three kept, it drops others.

    A picture is its number: picture k is taken 20 k ms after the start. Only waiting for one, and a
    tenth of a millisecond for each grab, moves the clock.
    """

    def __init__(self):
        self.start = self.now = 100.0
        self.taken = self.fetched = 0
        self.kept = []

    def monotonic(self):
        return self.now

    def take(self, until):
        self.kept += [*range(self.taken + 1, until + 1)][: 3 - len(self.kept)]
        self.taken = max(self.taken, until)

    def grab(self):
        self.now += 1e-4
        self.take(int((self.now - self.start) / 0.02))
        if not self.kept:
            self.take(self.taken + 1)
            self.now = self.start + 0.02 * self.taken
        self.fetched = self.kept.pop(0)
        return True

    def retrieve(self):
        return True, np.full((48, 64, 3), self.fetched % 256, np.uint8)

    def set(self, *_):
        return True

    def isOpened(self):  # noqa: N802  OpenCV's name
        return True

    def release(self):
        pass


def test_a_picture_that_the_driver_has_kept_is_passed_over(monkeypatch):
    """Nobody knows since when it was waiting; each that is given has the time of its grab."""
    driver = Capture()
    monkeypatch.setattr(cv2, "VideoCapture", lambda _: driver)
    monkeypatch.setattr("bolfi_liquids.hardware.cameras.webcam.time", driver)
    camera = Webcam(0, size=(64, 48))
    for pause in (0.0, 0.012, 0.11, 0.0, 0.025, 0.5):
        driver.now += pause
        frame = camera.read()
        assert frame is not None
        assert frame.image.mean() == driver.fetched % 256
        assert frame.stamp == pytest.approx(driver.start + 0.02 * driver.fetched, abs=1e-3)
    assert frame.index > 6


class Asked:
    """A world that notes when it was asked."""

    def __init__(self, offset: float) -> None:
        self.times: list[float] = []
        self._world = MovingWorld(
            lambda t: np.array([0.0, 0.0, 0.235]), lambda t: np.array([0.01 * t, 0.0]), offset
        )

    def state(self, host: float):
        self.times.append(host)
        return self._world.state(host)


def rendered(timing: Timing, clock: SteppedClock, world, **kwargs) -> RenderedCamera:
    look = dataclasses.replace(CLEAN, read_noise=1.0)
    stage = prepare(rehearsal_scene("xz"), rehearsal_camera("xz"), look)
    return RenderedCamera(stage, world, timing, clock=clock, **kwargs)


def test_a_rendered_camera_keeps_time(tmp_path):
    clock, world = SteppedClock(50.0), Asked(offset=100.0)
    timing = Timing(rate=25.0, latency=0.03)
    camera = rendered(timing, clock, world, truth=tmp_path / "truth_xz.csv")
    frames = [camera.read() for _ in range(51)]
    camera.close()
    stamps = np.array([f.stamp for f in frames])
    np.testing.assert_allclose(world.times, 50.0 + np.arange(51) / 25.0, atol=1e-9)
    np.testing.assert_allclose(stamps, np.array(world.times) + 0.03, atol=1e-9)
    with (tmp_path / "truth_xz.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["index"]) for row in rows] == list(range(51))
    np.testing.assert_allclose([float(r["stamp"]) for r in rows], stamps)
    np.testing.assert_allclose([float(r["time"]) for r in rows], np.array(world.times) + 100.0)
    xz = [float(r["inclination_xz"]) for r in rows]
    np.testing.assert_allclose(xz, 0.01 * (np.array(world.times) + 100.0))


def test_a_late_frame_shows_its_own_moment_and_only_old_ones_are_lost():
    clock, world = SteppedClock(50.0), Asked(offset=0.0)
    camera = rendered(Timing(rate=25.0, latency=0.0), clock, world)
    camera.read()
    clock.sleep(0.15)
    late = [camera.read() for _ in range(3)]
    assert [f.index for f in late if f] == [1, 2, 3]
    np.testing.assert_allclose(world.times[1:], 50.0 + np.array([1, 2, 3]) / 25.0)
    clock.sleep(1.0)
    assert camera.read().index > 20
    assert clock.now() - world.times[-1] <= 0.2 + 1e-9
