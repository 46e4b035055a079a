import os
import resource
import signal
import time
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, make_interp_spline

pytest.importorskip("cv2")
pytest.importorskip("av")

from bolfi_liquids.hardware.board import SPAWN, Board, Trouble, Who, host_time  # noqa: E402
from bolfi_liquids.hardware.cameras.files import FilesCamera  # noqa: E402
from bolfi_liquids.hardware.cameras.rendered import RenderedCamera, Timing  # noqa: E402
from bolfi_liquids.hardware.csv_file import read_csv  # noqa: E402
from bolfi_liquids.hardware.recorder.events import read_events  # noqa: E402
from bolfi_liquids.hardware.recorder.video import VideoWriter  # noqa: E402
from bolfi_liquids.hardware.rendering import Look, Scene  # noqa: E402
from bolfi_liquids.hardware.rendering.drawing import prepare, render  # noqa: E402
from bolfi_liquids.hardware.rendering.world import WorldState  # noqa: E402
from bolfi_liquids.hardware.rig_file import bundled_rig  # noqa: E402
from bolfi_liquids.hardware.session.camera_process import _Tally as Tally  # noqa: E402
from bolfi_liquids.hardware.session.camera_process import run_camera, tallied  # noqa: E402
from bolfi_liquids.hardware.vision.frame import (
    Frame,  # noqa: E402
    FrameMeasurement,
)
from bolfi_liquids.hardware.vision.measuring import FrameMeter  # noqa: E402
from bolfi_liquids.hardware.vision.stick_view import camera_model, stick_view
from rendered_scenes import CLEAN, MovingWorld  # noqa: E402

# pictures come at 30 Hz, and none may be missed; the others keep no time
keeps_time = pytest.mark.punctual

RIG = bundled_rig()
HEIGHT = RIG.stirring.height
CALM = Look()


@cache
def stage(look):
    camera = RIG.camera("xz")
    scene = Scene(marker_offset=camera.marker, marker_radius=camera.marker_radius)
    return prepare(scene, camera_model(camera), look)


def swing(time):
    """Pivot [m] and inclination [rad] of a closed-form motion."""
    time = np.asarray(time, dtype=float)
    still = np.zeros_like(time)
    pivot = np.stack([0.02 * np.sin(3 * time), still, still + HEIGHT], axis=-1)
    return pivot, np.stack([0.1 * np.sin(3 * time + 1), still], axis=-1)


def moving_world(seconds=20.0):
    """Splines, because a spawned process must be able to read them."""
    start = host_time()
    time = start + np.arange(-1.0, seconds, 0.01)
    pivot, inclination = swing(time)
    return MovingWorld(CubicSpline(time, pivot), CubicSpline(time, inclination))


class Running:
    """A camera's process, and the end of the pipe that main holds."""

    def __init__(self, directory, make_camera):
        self.board = Board()
        theirs, self.main = SPAWN.Pipe()
        self.process = SPAWN.Process(
            target=run_camera, args=(RIG, "xz", make_camera, self.board, theirs, directory)
        )
        self.process.start()
        theirs.close()

    def wait(self, what, timeout=30.0):
        deadline = time.monotonic() + timeout
        while not what(row := self.board.read(Who.CAMERA_XZ)):
            assert time.monotonic() < deadline and self.process.is_alive(), row
            time.sleep(0.002)
        return row

    def end(self):
        """Let go as a main process that dies; the time until the camera's has ended [s]."""
        self.main.close()
        start = time.monotonic()
        self.process.join(20)
        assert not self.process.is_alive()
        return time.monotonic() - start


@pytest.fixture
def start(tmp_path):
    running = []

    def start(make_camera, directory=tmp_path):
        running.append(Running(directory, make_camera))
        return running[-1]

    yield start
    for one in running:
        one.process.kill()
        one.process.join()
        one.main.close()


def rendered(look=CALM, timing=None, world=None):
    return partial(RenderedCamera, stage(look), world or moving_world(), timing)


def frames(directory):
    return read_csv(directory / "frames_xz.csv", FrameMeasurement._fields)


def pictures(directory):
    camera, seen = FilesCamera(directory / "xz.mkv"), []
    while (frame := camera.read()) is not None:
        seen.append(frame)
    camera.close()
    return seen


@keeps_time
def test_rows_and_pictures_agree_and_main_s_end_ends_the_process(start, tmp_path):
    running = start(rendered())
    running.wait(lambda row: row.count >= 30)
    os.kill(running.process.pid, signal.SIGINT)  # as Ctrl-C sends it to all
    row = running.wait(lambda row: row.count >= 60)
    assert row.trouble == Trouble.NONE
    assert abs(row.value) < 0.11
    assert running.end() < 0.5
    assert running.process.exitcode == 0
    table, video = frames(tmp_path), pictures(tmp_path)
    assert len(video) == len(table["index"]) >= 60
    taken = table["stamp"] - table["stamp"][0]
    assert row.rate == pytest.approx((row.count - 1) / taken[int(row.count) - 1], rel=0.05)
    np.testing.assert_allclose([frame.stamp for frame in video], taken, atol=1.1e-3)
    angle = swing(table["stamp"] - Timing().latency)[1][:, 0]
    good = table["flags"] == 0
    assert good.mean() > 0.9
    assert np.abs(table["angle"] - angle)[good].max() < np.radians(0.3)
    (last,) = read_events(tmp_path)
    assert (last["source"], last["kind"], last["frames"]) == ("camera_xz", "left", len(video))
    assert last["lost"] == 0


def test_a_killed_camera_process_loses_less_than_a_second(start, tmp_path):
    running = start(rendered())
    read = running.wait(lambda row: row.count >= 30).count
    running.process.kill()
    running.process.join()
    table = frames(tmp_path)
    assert read <= len(table["index"]) <= read + 2
    assert len(pictures(tmp_path)) >= read - 2


@keeps_time
@pytest.mark.slow
def test_a_short_delay_loses_no_picture_and_a_long_one_is_counted(start, tmp_path):
    running = start(rendered())
    row = running.wait(lambda row: row.count >= 10)
    for delay in (0.12, 1.0):
        os.kill(running.process.pid, signal.SIGSTOP)
        time.sleep(delay)
        os.kill(running.process.pid, signal.SIGCONT)
        row = running.wait(lambda later, before=row: later.count >= before.count + 15)
    running.end()
    table = frames(tmp_path)
    steps = np.diff(table["index"])
    gaps = steps[steps > 1] - 1
    assert 15 < gaps.sum() < 32
    assert len(gaps) == 1
    assert read_events(tmp_path)[-1]["lost"] == gaps.sum()
    assert len(pictures(tmp_path)) == len(table["index"])


def test_the_line_is_where_it_was_in_the_recorded_video(tmp_path):
    scenery, rng = stage(CALM), np.random.default_rng(0)
    live, again = FrameMeter(stick_view(RIG, "xz")), FrameMeter(stick_view(RIG, "xz"))
    video = VideoWriter(tmp_path / "xz.mkv", size=(640, 480), rate=30.0)
    angles = []
    for k in range(40):
        pivot, inclination = swing(k / 30)
        image = render(scenery, [WorldState(k / 30, pivot, inclination)], rng)
        angles.append(live.measure(Frame(k, k / 30, image)).angle)
        video.write(image, k / 30)
    video.close()
    recorded = [again.measure(frame).angle for frame in pictures(tmp_path)]
    assert np.degrees(np.abs(np.subtract(recorded, angles))).max() < 0.02


def test_a_video_has_the_times_of_its_pictures(tmp_path):
    stamps = [np.nan, 100.0, 100.0334, 100.2, 100.2, np.inf, 100.1, 101.5]  # each costs no video
    video = VideoWriter(tmp_path / "xz.mkv", size=(642, 482), rate=30.0)
    for k, stamp in enumerate(stamps):
        video.write(np.full((482, 642), 30 * k, np.uint8), stamp)
    with pytest.raises(ValueError, match=r"\(480, 640\).*\(482, 642\)"):
        video.write(np.zeros((480, 640), np.uint8), 102.0)
    video.close()
    video.close()
    seen = pictures(tmp_path)
    assert [round(1e3 * frame.stamp) for frame in seen] == [0, 1, 33, 200, 201, 202, 203, 1500]
    assert [int(np.median(frame.image)) for frame in seen] == [30 * k for k in range(8)]


@keeps_time
@pytest.mark.slow
def test_the_same_picture_again_looks_dead_and_is_recorded(start, tmp_path):
    stop = host_time() + 2.0
    time_ = np.arange(stop - 10.0, stop + 20.0, 0.01)
    pivot, inclination = swing(np.minimum(time_, stop))
    world = MovingWorld(*(make_interp_spline(time_, y, k=1) for y in (pivot, inclination)))
    running = start(rendered(CLEAN, world=world))
    assert running.wait(lambda row: row.count >= 5).trouble == Trouble.NONE
    row = running.wait(lambda row: row.trouble)
    assert row.trouble == Trouble.SAME_PICTURE
    after = running.wait(lambda later: later.count >= row.count + 10)
    assert after.beat == row.beat
    running.end()
    table = frames(tmp_path)
    assert len(pictures(tmp_path)) == len(table["index"]) >= after.count
    (same, _) = read_events(tmp_path)
    assert same["kind"] == "same_picture"
    shown_since = table["stamp"][table["index"] == same["index"]] - Timing().latency - stop
    assert 0 < shown_since[0] < 4 / 30


class StandingClock:
    """A camera whose stamps stand still from a frame on."""

    def __init__(self, make, after):
        self._camera, self._after, self._stamp = make(), after, None

    def read(self):
        frame = self._camera.read()
        if frame.index < self._after:
            self._stamp = frame.stamp
        return frame._replace(stamp=self._stamp)

    def close(self):
        self._camera.close()


@pytest.mark.slow
@pytest.mark.usefixtures("importable")
def test_a_clock_that_stands_still_after_the_start_is_told(start, tmp_path):
    running = start(partial(StandingClock, rendered(), 30))
    row = running.wait(lambda row: row.trouble, timeout=120.0)
    assert row.trouble == Trouble.BAD_STAMPS
    running.end()
    (told,) = (event for event in read_events(tmp_path) if event["kind"] == "bad_stamps")
    assert told["index"] >= 30
    assert "stand still" in told["reason"] and f"frame {told['index']}" in told["reason"]


def test_a_camera_that_ends_or_cannot_be_used_is_told(start, tmp_path):
    for name, size, frames_kept, told in (
        ("source.mkv", (640, 480), 10, "no more"),
        ("small.mkv", (320, 240), 0, "(240, 320)"),
        ("nothing.mkv", None, 0, "nothing.mkv"),
    ):
        if size is not None:
            video = VideoWriter(tmp_path / name, size=size, rate=30.0)
            for k in range(10):
                video.write(np.full(size[::-1], 20 * k, np.uint8), k / 30)
            video.close()
        folder = tmp_path / name.partition(".")[0]
        folder.mkdir()
        running = start(partial(FilesCamera, tmp_path / name), folder)
        row = running.wait(lambda row: row.trouble)
        assert (row.trouble, row.count) == (Trouble.SOURCE_LOST, frames_kept)
        running.end()
        lost, left = read_events(folder)
        assert (lost["kind"], left["frames"]) == ("source_lost", frames_kept)
        assert told in lost["reason"]
        assert len(frames(folder)["index"]) == frames_kept


@keeps_time
@pytest.mark.slow
def test_a_camera_that_never_answers_does_not_keep_its_process(start, tmp_path):
    running = start(rendered(timing=Timing(latency=100.0)))
    deadline = time.monotonic() + 10
    while not (tmp_path / "xz.mkv").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    time.sleep(0.3)
    assert running.board.read(Who.CAMERA_XZ).beat == 0.0
    assert running.end() < 0.5
    (left,) = read_events(tmp_path)
    assert left["reason"] == "the camera does not answer"


def write_that_failed(running, directory):
    """The event of it, of a camera that goes on until it is ended."""
    row = running.wait(lambda row: row.trouble and row.beat)
    assert row.trouble == Trouble.WRITE_FAILED
    later = running.wait(lambda later: later.count > row.count + 5)
    assert later.beat > row.beat
    running.end()
    failed, left = read_events(directory)
    assert (failed["kind"], left["kind"]) == ("write_failed", "left")
    return failed


@pytest.mark.parametrize("file", ["frames_xz.csv", "xz.mkv"])
def test_a_file_that_may_not_grow_is_told_and_the_camera_goes_on(start, tmp_path, file):
    running = start(rendered())
    running.wait(lambda row: row.count >= 10)
    size = (tmp_path / file).stat().st_size + 50
    # the table's limit stops the video too, whichever of them is written first
    resource.prlimit(running.process.pid, resource.RLIMIT_FSIZE, (size, size))
    assert write_that_failed(running, tmp_path)["file"] in ("frames_xz.csv", "xz.mkv")
    assert len(frames(tmp_path)["index"]) >= 10


@pytest.mark.parametrize("file", ["frames_xz.csv", "xz.mkv"])
def test_a_full_disk_is_told_and_the_camera_goes_on(start, tmp_path, file):
    (tmp_path / file).symlink_to("/dev/full")  # each write fails as on a full disk (ENOSPC)
    failed = write_that_failed(start(rendered()), tmp_path)
    assert failed["file"] == file and "make room" in failed["reason"]


def test_lost_and_repeated_pictures_are_counted():
    tally, meter = Tally(), FrameMeter(stick_view(RIG, "xz"))
    for k, index in enumerate([0, 1, 2, 5, 6, 10]):
        image = np.full((480, 640), min(k, 3), np.uint8)
        tally = tallied(tally, meter.measure(Frame(index, k / 30, image)), 1.0 + k / 30)
    assert (tally.row.count, tally.lost, tally.same) == (6, 5, 3)
    assert tally.row.beat == pytest.approx(1.1)
    assert tally.row.worst == pytest.approx(1 / 30)


def test_a_camera_that_falls_to_half_its_rate_shows_that():
    tally, time_, blank = Tally(), 1.0, np.zeros((480, 640), np.uint8)
    row = FrameMeter(stick_view(RIG, "xz")).measure(Frame(0, 0.0, blank))
    for rate, seconds in ((30.0, 10.0), (15.0, 2.1)):
        for k in range(round(seconds * rate)):
            tally = tallied(tally, row._replace(index=k), time_)
            time_ += 1.0 / rate
        assert tally.row.rate == pytest.approx(rate, rel=0.03)


@pytest.mark.minutes
def test_memory_and_open_files_do_not_grow(start):
    running = start(rendered(timing=Timing(rate=60.0), world=moving_world(400.0)))
    process = Path(f"/proc/{running.process.pid}")

    def used():
        pages = int((process / "statm").read_text().split()[1])
        return pages * resource.getpagesize(), len(list((process / "fd").iterdir()))

    running.wait(lambda row: row.count >= 300, timeout=300)
    memory, files = used()
    running.wait(lambda row: row.count >= 1500, timeout=300)
    assert used()[1] == files
    assert used()[0] - memory < 5e6
