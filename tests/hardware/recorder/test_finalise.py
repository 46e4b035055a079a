import errno
import json
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import pytest
import xarray
from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.recorder.directory import (
    discard_directory,
    read_provenance,
    rig_hash,
    start_directory,
)
from bolfi_liquids.hardware.recorder.events import RESERVE, outcome
from bolfi_liquids.hardware.recorder.finalise import finalise, partial
from bolfi_liquids.hardware.recorder.stir import robot_time
from bolfi_liquids.hardware.vision.frame import Flag
from bolfi_liquids.hardware.vision.stick_view import camera_model
from closed_form_session import (
    COMPLETED,
    DELAY,
    MARKER_NOISE,
    NOISE,
    READ_LATE,
    RIG,
    WAY,
    inclination,
    pivot,
)
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.cli.app import app


def test_a_recording_is_what_the_closed_forms_say(session):
    directory = session()
    path = finalise(directory)
    recording = bl.open_recording(path)
    assert recording.attrs["status"] == "complete"
    assert recording.attrs["source"] == "a closed form"
    assert recording.attrs["rig_hash"] == rig_hash(RIG)
    assert (recording.attrs["lost_samples"], recording.attrs["camera_xz_lost_frames"]) == (0, 0)
    assert recording.attrs["camera_yz_frame_rate"] == pytest.approx(30.0, rel=1e-3)
    assert recording.attrs["loop_late_max_ms"] == pytest.approx(0.4)
    assert recording.attrs["camera_xz_marker_residual_px"] == pytest.approx(MARKER_NOISE, rel=0.2)
    for view, delay in DELAY.items():
        # a sample is read a millisecond after its time
        assert abs(recording.attrs[f"camera_{view}_delay"] + READ_LATE - delay) < 2e-4
        assert 0 < recording.attrs[f"camera_{view}_delay_error"] < 5e-4

    np.testing.assert_allclose(np.diff(recording.time), 1 / 30, atol=1e-12)
    assert recording.time[-1] == pytest.approx(12.0, abs=1 / 30)
    robot_time = WAY + recording.time
    path_apart = recording.gripper.position - pivot(robot_time, 12.0)
    assert np.abs(path_apart).max() < 2e-5
    apart = recording.inclination - inclination(robot_time)
    assert np.degrees(np.abs(apart)).max() < 0.15  # four times the noise of a frame
    assert np.degrees(np.sqrt(np.mean(apart**2))) < 0.04
    with xarray.open_dataset(path) as dataset:
        error = dataset["inclination_xz_error"].to_numpy()
        assert np.median(error) == pytest.approx(NOISE, rel=0.5)
        assert (dataset["flags"] == 0).all()
    assert not (directory / RESERVE).exists()
    assert not list(directory.glob(".recording*"))


@pytest.mark.parametrize("drift", [1.5e-4, -1.5e-4])
def test_samples_that_are_read_late_do_not_shift_the_clocks(drift):
    rng = np.random.default_rng(0)
    time = 700.0 + np.arange(0.0, 20.0, 0.008)
    host = 5000.0 + (time - 700.0) * (1.0 + drift) + 0.004 * rng.random(len(time))
    host[100:140] += 0.3
    host[2000:2200] += np.linspace(0.1, 0.0, 200)
    stamp = 5000.0 + np.array([0.0, 10.0, 20.0]) * (1.0 + drift)
    found = robot_time(stamp, host, time) + 0.002  # samples are read so late in the mean
    np.testing.assert_allclose(found, 700.0 + np.array([0.0, 10.0, 20.0]), atol=5e-4)


def test_a_wrong_truth_would_be_seen(session):
    """The bars above have power: 5 ms between marker and stick break them."""

    def late(_, frames):
        rows, share = frames["xz"], 0.005 * 30
        frames["xz"] = [
            f._replace(angle=f.angle + share * (g.angle - f.angle)) for g, f in pairwise(rows)
        ]

    recording = bl.open_recording(finalise(session(change=late)))
    apart = recording.inclination - inclination(WAY + recording.time)
    assert np.degrees(np.sqrt(np.mean(apart[:, 0] ** 2))) > 0.08


def test_doubtful_frames_are_passed_over_and_long_gaps_are_flagged(session):
    def spoil(_, frames):
        rows = frames["yz"]
        for k in (100, 150, 151):
            rows[k] = rows[k]._replace(angle=1.0, flags=int(Flag.DISAGREE))
        for k in range(200, 210):
            rows[k] = rows[k]._replace(angle=float("nan"), offset=float("nan"), flags=1)

    recording = bl.open_recording(path := finalise(session(change=spoil)))
    seen = np.isfinite(recording.inclination).all(axis=1)
    assert 0.27 < (~seen).sum() / 30 < 0.4
    apart = recording.inclination - inclination(WAY + recording.time)
    assert np.degrees(np.abs(apart[seen])).max() < 0.3
    with xarray.open_dataset(path) as dataset:
        flags = dataset["flags"].to_numpy()
        assert dataset.attrs["camera_yz_flagged"] == pytest.approx(13 / 480, rel=0.01)
    assert ((flags & int(Flag.GAP)) != 0).tolist() == (~seen).tolist()


def test_a_camera_that_stopped_ends_the_recording_and_is_named(session, view="yz"):
    def stop(_, frames):
        del frames[view][240:]

    events = ({"source": f"camera_{view}", "kind": "source_lost", "reason": "unplugged"},)
    recording = bl.open_recording(finalise(session(change=stop, events=events)))
    assert recording.time[-1] == pytest.approx(240 / 30 - WAY, abs=0.1)
    assert recording.attrs["status"] == "aborted"
    assert recording.attrs["reason"] == f"camera_{view}: source lost: unplugged"


def test_a_robot_that_fell_silent_ends_the_recording(session):
    def silent(samples, _):
        del samples[1000:1100]

    recording = bl.open_recording(finalise(session(change=silent)))
    assert recording.time[-1] == pytest.approx(8.0 - WAY, abs=0.1)
    assert (recording.attrs["status"], recording.attrs["lost_samples"]) == ("aborted", 100)
    assert "no samples of the robot for 0.81 s" in recording.attrs["reason"]


def test_what_a_killed_session_left_is_made_a_recording_and_cut_by_one_command(session, tmp_path):
    def cut(samples, frames):
        del samples[1250:], frames["xz"][298:], frames["yz"][280:]

    directory, out = session(change=cut, events=()), tmp_path / "cut.nc"
    for name in ("samples.csv", "frames_xz.csv", "frames_yz.csv"):
        with (directory / name).open("a") as file:
            file.write("298,10.0,501")
    (directory / "events.jsonl").unlink()
    done = CliRunner().invoke(app, ["trim", str(directory), "--out", str(out)])
    assert done.exit_code == 0, done.stderr
    recording = bl.open_recording(out)
    assert np.isfinite(recording.inclination[-1]).all()
    assert recording.attrs["status"] == "aborted" and "killed" in recording.attrs["reason"]
    assert recording.time[-1] == pytest.approx(280 / 30 - WAY, abs=0.2)
    apart = recording.inclination - inclination(WAY + recording.time)
    assert np.degrees(np.nanmax(np.abs(apart))) < 0.15
    assert len(recording.attrs["history"].splitlines()) == 2


def test_repeated_samples_and_frames_do_no_harm(session):
    def repeat(samples, frames):
        samples[700:700] = samples[690:700]
        for k in (198, 199):
            frames["xz"][k] = frames["xz"][197]._replace(
                index=k, stamp=frames["xz"][k].stamp, flags=int(Flag.REPEATED_IMAGE)
            )

    recording = bl.open_recording(finalise(session(change=repeat)))
    apart = recording.inclination - inclination(WAY + recording.time)
    assert np.degrees(np.nanmax(np.abs(apart))) < 0.15


FAULT = 250  # frame of a stir of 12 s, in its middle


def standing(rows):
    return [frame._replace(stamp=rows[0].stamp) for frame in rows]


def later(rows):
    return [frame._replace(stamp=frame.stamp + 0.5) for frame in rows]


def no_numbers(rows):
    return [frame._replace(stamp=np.nan) for frame in rows]


@pytest.mark.parametrize(("view", "change"), [("xz", standing), ("yz", no_numbers), ("xz", later)])
def test_a_camera_whose_stamps_fail_ends_the_recording_and_is_named(session, view, change):
    def fail(_, frames):
        frames[view][FAULT - 1 :] = [
            frames[view][FAULT - 1],
            *change(frames[view][FAULT - 1 :])[1:],
        ]

    recording = bl.open_recording(finalise(session(change=fail)))
    assert recording.time[-1] == pytest.approx(FAULT / 30 - WAY, abs=0.15)
    reason = recording.attrs["reason"]
    assert recording.attrs["status"] == "aborted"
    assert f"view {view}" in reason and f"frame {FAULT}" in reason
    apart = recording.inclination - inclination(WAY + recording.time)
    assert np.degrees(np.nanmax(np.abs(apart))) < 0.15


def test_pictures_may_be_lost_before_the_stir_and_for_less_than_half_a_second(session):
    def lose(_, frames):
        del frames["yz"][300:313], frames["yz"][10:30]

    recording = bl.open_recording(path := finalise(session(change=lose)))
    assert recording.attrs["status"] == "complete"
    assert recording.attrs["camera_yz_lost_frames"] == 33
    seen = np.isfinite(recording.inclination).all(axis=1)
    assert (~seen).sum() == pytest.approx(13, abs=1)
    with xarray.open_dataset(path) as dataset:
        assert ((dataset["flags"].to_numpy() & int(Flag.GAP)) != 0).tolist() == (~seen).tolist()


def no_frames(_, frames):
    frames["yz"].clear()


def no_stir(samples, _):
    samples[:] = [sample._replace(stirring=0) for sample in samples]


def short_stir(samples, frames):
    for rows, rate in ((samples, 125), *((rows, 30) for rows in frames.values())):
        del rows[int((WAY + 0.5) * rate) :]


def unseen(_, frames):
    frames["xz"][:] = [f._replace(angle=np.nan, flags=1) for f in frames["xz"]]


def no_marker(_, frames):
    frames["xz"][:] = [f._replace(marker_column=np.nan) for f in frames["xz"]]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (no_frames, "frames_yz.csv"),
        (no_stir, "none of its 2000 samples"),
        (short_stir, "s of a stir"),
        (unseen, "view xz"),
        (no_marker, "view xz"),
    ],
)
def test_too_little_is_refused_and_says_what_is_missing(session, change, named):
    directory = session(change=change)
    with pytest.raises(RigError, match=named):
        finalise(directory)
    assert not (directory / "recording.nc").exists()


def test_a_failed_write_leaves_the_earlier_recording(session, monkeypatch):
    directory = session()
    before = finalise(directory).read_bytes()

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(xarray.Dataset, "to_netcdf", full)
    with pytest.raises(OSError, match="No space"):
        finalise(directory)
    assert (directory / "recording.nc").read_bytes() == before
    assert not list(directory.glob(".recording*"))


def test_the_stir_so_far_is_the_beginning_of_the_whole(session):
    directory = session(duration=56.0)
    whole = partial(directory)
    start = time.process_time()
    so_far = partial(directory, until=WAY + 20.0)
    assert time.process_time() - start < 1.0  # 0.1 s of a core
    assert so_far.time[-1] == pytest.approx(20.0, abs=1 / 30)
    count = len(so_far.time)
    np.testing.assert_allclose(so_far.time, whole.time[:count])
    np.testing.assert_allclose(so_far.position, whole.position[:count], atol=1e-9)
    apart = np.degrees(np.abs(so_far.inclination - whole.inclination[:count]))
    assert apart[:-4].max() < 0.02
    with pytest.raises(RigError, match="none of its"):
        partial(directory, until=WAY - 0.5)


def event(source, kind, reason):
    return {"source": source, "kind": kind, "reason": reason}


@pytest.mark.parametrize(
    ("events", "cut", "status", "reason"),
    [
        (COMPLETED, "", "complete", "carried out"),
        (COMPLETED, "no samples", "aborted", "no samples"),
        (COMPLETED[:-1], "", "aborted", "without a word"),
        (COMPLETED[:2] + COMPLETED[-1:], "", "aborted", "without a word"),  # no stir
        (COMPLETED[:3] + COMPLETED[-1:], "", "aborted", "without a word"),  # not done
        (tuple(e | {"source": "main"} for e in COMPLETED), "", "aborted", "without a word"),
        (
            (
                *COMPLETED[:3],
                event("camera_xz", "source_lost", "unplugged"),
                event("control", "stopped", "camera xz is silent"),
                COMPLETED[-1],
            ),
            "view xz",
            "aborted",
            "camera xz is silent",
        ),
        (
            (
                event("camera_xz", "bad_stamps", "from frame 812 on"),
                event("control", "stopped", "camera xz gives no times"),
            ),
            "",
            "aborted",
            "camera xz gives no times; camera_xz: bad stamps: from frame 812 on",
        ),
        (
            (
                event("control", "stopped", "recorder cannot write"),
                event("recorder", "write_failed", "samples.csv: full"),
            ),
            "",
            "aborted",
            "recorder cannot write; recorder: write failed: samples.csv: full",
        ),
    ],
)
def test_only_control_s_word_makes_a_recording_complete(events, cut, status, reason):
    told = outcome(events, cut)
    assert told.status == status and reason in told.reason


def test_a_directory_is_made_once_and_knows_its_rig(tmp_path):
    directory = start_directory(tmp_path / "a" / "b", RIG, {"source": "here"})
    known = read_provenance(directory)
    assert known.rig == RIG
    assert known.extra == {"source": "here"}
    live = camera_model(RIG.camera("yz"))
    np.testing.assert_array_equal(known.cameras["yz"].rotation, live.rotation)
    assert known.cameras["yz"].focal == live.focal
    with pytest.raises(RigError, match="already.*new directory"):
        start_directory(directory, RIG)
    (tmp_path / "file").write_text("")
    with pytest.raises(RigError, match="file"):
        start_directory(tmp_path / "file", RIG)


def test_a_disk_with_too_little_room_or_a_damaged_rig_file_is_refused(tmp_path, monkeypatch):
    with pytest.raises(RigError, match=r"rig\.json"):
        finalise(tmp_path)
    (tmp_path / "rig.json").write_text('{"rig": ')
    with pytest.raises(RigError, match=r"rig\.json"):
        finalise(tmp_path)
    monkeypatch.setattr("shutil.disk_usage", lambda _: type("Usage", (), {"free": 5_000_000})())
    with pytest.raises(RigError, match="5 MB are free"):
        start_directory(tmp_path / "a", RIG)


def test_a_recording_of_a_rig_that_may_not_move_any_more_is_read(session, tmp_path):
    """Ends of a rig's numbers keep an arm from harm; a recording moves nothing."""
    directory = session()
    known = json.loads((directory / "rig.json").read_text())
    known["rig"]["limits"] |= {"force": 100.0, "frame_age": 0.5, "acceleration": 2.0}
    known["rig"]["stirring"] |= {"acceleration": 2.0, "cycles": 500}
    known["rig"]["robot"]["start"][0] += 0.5
    known["rig"]["pouring"]["receiver"] = known["rig"]["cup"]["position"]
    (directory / "rig.json").write_text(json.dumps(known))
    assert bl.open_recording(finalise(directory)).attrs["status"] == "complete"
    assert partial(directory).origin > 0.0
    out = tmp_path / "cut.nc"
    done = CliRunner().invoke(app, ["trim", str(directory), "--out", str(out)])
    assert done.exit_code == 0, done.stderr


def test_a_disk_that_is_full_at_the_start_leaves_nothing_in_the_way(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("os.posix_fallocate", full)
        with pytest.raises(RigError, match="make room"):
            start_directory(tmp_path / "a", RIG)
    start_directory(tmp_path / "a", RIG)


LIMITED = """
import resource, sys
from bolfi_liquids.hardware.recorder.directory import start_directory
from bolfi_liquids.hardware.rig_file import bundled_rig
resource.setrlimit(resource.RLIMIT_FSIZE, (100, resource.RLIM_INFINITY))
start_directory(sys.argv[1], bundled_rig())
"""


def test_a_rig_file_that_is_not_written_whole_is_not_left(tmp_path):
    command = [sys.executable, "-c", LIMITED, str(tmp_path / "a")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert "File too large; make room" in done.stderr
    start_directory(tmp_path / "a", RIG)


def test_only_what_a_session_left_before_any_motion_is_discarded(session, tmp_path):
    moved = session()
    held = sorted(moved.iterdir())
    discard_directory(moved)
    assert sorted(moved.iterdir()) == held
    rested = start_directory(tmp_path / "rested", RIG)
    for name in ("events.jsonl", "samples.csv", "frames_xz.csv", "xz.mkv", "truth_yz.csv"):
        (rested / name).write_text("")
    discard_directory(rested)
    assert not rested.exists()
    other = start_directory(tmp_path / "other", RIG)
    (other / "notes.txt").write_text("mine")
    discard_directory(other)
    assert [path.name for path in other.iterdir()] == ["notes.txt"]
    discard_directory(tmp_path / "nothing")


def test_of_two_sessions_that_start_together_one_gets_the_directory(tmp_path):
    together = threading.Barrier(2)

    def start(directory):
        together.wait(30.0)
        try:
            start_directory(directory, RIG, duration=0.0, videos=False)
        except RigError as err:
            return str(err)
        return ""

    with ThreadPoolExecutor(2) as pool:
        for number in range(8):
            directory = tmp_path / str(number)
            told = sorted(pool.map(start, [directory, directory]))
            assert told[0] == "" and "holds " in told[1], told
            read_provenance(directory)
