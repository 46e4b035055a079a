"""Recorder and both cameras as real processes, killed in the middle of a stir."""

import threading
import time
from functools import partial

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

pytest.importorskip("cv2")
pytest.importorskip("av")

from bolfi_liquids.hardware.board import SPAWN, Board, Who, host_time  # noqa: E402
from bolfi_liquids.hardware.cameras.rendered import Timing  # noqa: E402
from bolfi_liquids.hardware.recorder.directory import start_directory  # noqa: E402
from bolfi_liquids.hardware.recorder.finalise import finalise  # noqa: E402
from bolfi_liquids.hardware.recorder.samples import Sample, run_recorder
from bolfi_liquids.hardware.rendering import Look, Scene  # noqa: E402
from bolfi_liquids.hardware.rendering.drawing import prepare  # noqa: E402
from bolfi_liquids.hardware.rig_file import bundled_rig  # noqa: E402
from bolfi_liquids.hardware.session.camera_process import WHO, run_camera  # noqa: E402
from bolfi_liquids.hardware.vision.stick_view import camera_model
from rendered_faults import FaultyCamera  # noqa: E402
from rendered_scenes import MovingWorld  # noqa: E402

from bolfi_liquids.inputs.checks import check_values  # noqa: E402
from bolfi_liquids.inputs.open import read_recording  # noqa: E402

pytestmark = pytest.mark.punctual

RIG = bundled_rig()
ROBOT = 700.25  # the robot's clock minus this computer's [s]
STIRRED = 5.0  # s


def motion(robot_time):
    """Pivot [m] and inclination [rad] of a closed-form motion."""
    t = np.asarray(robot_time, dtype=float)
    height = np.full_like(t, RIG.stirring.height)
    pivot = np.stack([0.02 * np.sin(4.0 * t), 0.02 * np.sin(2.7 * t), height], axis=-1)
    return pivot, np.stack([0.15 * np.sin(4.0 * t + 0.3), 0.12 * np.cos(2.7 * t)], axis=-1)


def camera_of(view):
    camera = RIG.camera(view)
    scene = Scene(marker_offset=camera.marker, marker_radius=camera.marker_radius)
    stage = prepare(scene, camera_model(camera), Look())
    time = ROBOT + host_time() + np.arange(-2.0, 40.0, 0.01)
    world = MovingWorld(*(CubicSpline(time, y) for y in motion(time)), offset=ROBOT)
    return partial(FaultyCamera, stage, world, Timing(seed=WHO[view]))


class Sampler(threading.Thread):
    """Sends the robot's samples at 125 Hz, as control does, until nobody takes them."""

    def __init__(self, samples):
        super().__init__(daemon=True)
        self._samples = samples
        self.ended = threading.Event()

    def run(self):
        start, rows = host_time(), []
        for k in range(100_000):
            time.sleep(max(start + k / 125 - host_time(), 0.0))
            now = host_time()
            (x, y, z), _ = motion(now + ROBOT)
            numbers = dict.fromkeys(Sample._fields, 0.0)
            numbers |= {"index": k, "time": now + ROBOT, "host": now, "x": x, "y": y, "z": z}
            rows.append(Sample(**numbers | {"stirring": int(now > start + 1.0)}))
            if len(rows) == 5:
                try:
                    self._samples.send(rows)
                except OSError:
                    break
                rows = []
            if self.ended.is_set():
                break


@pytest.mark.parametrize(
    "killed",
    [
        pytest.param("all", marks=pytest.mark.slow),
        *(pytest.param(one, marks=pytest.mark.minutes) for one in ("recorder", "camera_xz")),
    ],
)
def test_what_was_recorded_up_to_a_second_before_the_kill_can_be_used(tmp_path, killed):
    directory = start_directory(tmp_path / "session", RIG, {"source": "rendered"})
    board, mains, processes = Board(), [], {}
    receive, samples = SPAWN.Pipe(duplex=False)
    jobs = {"recorder": (run_recorder, (board, receive))}
    jobs |= {f"camera_{v}": (run_camera, (RIG, v, camera_of(v), board)) for v in ("xz", "yz")}
    for name, (job, arguments) in jobs.items():
        theirs, main = SPAWN.Pipe()
        processes[name] = SPAWN.Process(target=job, args=(*arguments, theirs, directory))
        processes[name].start()
        theirs.close()
        mains.append(main)
    receive.close()
    sampler = Sampler(samples)
    try:
        others = (Who.RECORDER, Who.CAMERA_XZ, Who.CAMERA_YZ)
        while not all(board.read(who).beat for who in others):
            assert all(process.is_alive() for process in processes.values())
            time.sleep(0.01)
        sampler.start()
        time.sleep(STIRRED)
        end = host_time() + ROBOT
        for name, process in processes.items():
            if killed in (name, "all"):
                process.kill()
        time.sleep(0.5)
        # as control does before main ends: the recorder waits for the robot's last sample
        sampler.ended.set()
        sampler.join()
        samples.close()
        for main in mains:
            main.close()
        for process in processes.values():
            process.join(5)
            assert not process.is_alive()
    finally:
        sampler.ended.set()
        for process in processes.values():
            process.kill()

    recording = read_recording(finalise(directory))
    check_values(recording)  # all but its start: what is drawn moves all the time
    assert recording.attrs["status"] == "aborted"
    last = recording.attrs["robot_time_origin"] + recording.time[-1]
    assert end - 1.0 < last < end + 0.2
    apart = recording.inclination - motion(recording.attrs["robot_time_origin"] + recording.time)[1]
    seen = np.isfinite(apart)
    assert seen.mean() > 0.9
    assert np.degrees(np.sqrt(np.mean(apart[seen] ** 2))) < 0.15
    assert np.degrees(np.abs(apart[seen])).max() < 1.0
