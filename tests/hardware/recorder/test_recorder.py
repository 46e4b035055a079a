import errno
import os
import resource
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.hardware.board import SPAWN, Board, Trouble, Who, host_time
from bolfi_liquids.hardware.csv_file import CsvAppender, read_csv
from bolfi_liquids.hardware.recorder.events import (
    RESERVE,
    RESERVE_BYTES,
    RESERVE_PARTS,
    EventLog,
    drop_reserve,
    make_reserve,
    read_events,
)
from bolfi_liquids.hardware.recorder.samples import SAMPLES, Sample, run_recorder

FIELDS = ("index", "value")


def sample(k):
    numbers = np.random.default_rng(k).normal(size=len(Sample._fields) - 3)
    return Sample(k, 8e-3 * k, host_time(), *numbers)


class Running:
    """A recorder, and the ends of its pipes that control and main hold."""

    def __init__(self, directory):
        self.board = Board()
        receive, self.samples = SPAWN.Pipe(duplex=False)
        theirs, self.main = SPAWN.Pipe()
        self.process = SPAWN.Process(
            target=run_recorder, args=(self.board, receive, theirs, directory)
        )
        self.process.start()
        receive.close()
        theirs.close()
        self.wait(lambda row: row.beat > 0)

    def wait(self, what, timeout=30.0):
        deadline = time.monotonic() + timeout
        while not what(row := self.board.read(Who.RECORDER)):
            assert time.monotonic() < deadline, row
            time.sleep(0.005)
        return row

    def send(self, first, last, batch=5):
        for k in range(first, last, batch):
            self.samples.send([sample(i) for i in range(k, min(k + batch, last))])


@pytest.fixture
def recorder(tmp_path):
    running = Running(tmp_path)
    yield running
    running.process.kill()
    running.process.join()
    running.samples.close()
    running.main.close()


def test_every_number_comes_back_bit_for_bit(tmp_path):
    rows = [(k, value) for k, value in enumerate([0.1, -0.0, 1e-300, np.float64(1 / 3), np.nan])]
    table = CsvAppender(tmp_path / "a.csv", FIELDS)
    table.append(rows[:2])
    table.append(rows[2:])
    table.close()
    columns = read_csv(tmp_path / "a.csv", FIELDS)
    assert columns["index"].tolist() == list(range(5))
    assert columns["value"].tobytes() == np.array([value for _, value in rows]).tobytes()


def test_a_table_that_there_is_already_is_left_alone(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("index,value\n1,0.25\n")
    with pytest.raises(FileExistsError):
        CsvAppender(path, FIELDS)
    assert path.read_text() == "index,value\n1,0.25\n"


def test_a_cut_or_damaged_row_is_left_out_and_another_table_is_refused(tmp_path):
    path = tmp_path / "a.csv"
    for left in ("3,0.1", "3,", "3", "", "\0\0\0\0\n", "3,0.5,7\n", "x,1\n"):
        path.write_text("index,value\n1,0.25\n2,0.5\n" + left)
        assert read_csv(path, FIELDS)["index"].tolist() == [1, 2]
    for content in ("", "ind", "index,value\n"):
        path.write_text(content)
        assert read_csv(path, FIELDS)["value"].shape == (0,)
    path.write_text("index,weight\n1,2\n")
    with pytest.raises(ValueError, match="index,weight"):
        read_csv(path, FIELDS)


def test_two_writers_of_events_do_not_mix(tmp_path):
    script = (
        "import sys; from pathlib import Path;"
        "from bolfi_liquids.hardware.recorder.events import EventLog;"
        "log = EventLog(Path(sys.argv[1]), sys.argv[2]); sys.stdin.read();"
        "[log.write('tick', k=k, text='x' * (k % 700)) for k in range(500)]"
    )
    command = [os.sys.executable, "-c", script, str(tmp_path)]
    writers = [subprocess.Popen([*command, name], stdin=subprocess.PIPE) for name in ("one", "two")]
    for writer in writers:
        writer.stdin.close()
    assert [writer.wait(30) for writer in writers] == [0, 0]
    events = read_events(tmp_path)
    assert len(events) == len((tmp_path / "events.jsonl").read_text().splitlines())
    for name in ("one", "two"):
        assert [e["k"] for e in events if e["source"] == name] == list(range(500))


def test_events_without_a_file_and_with_damaged_lines(tmp_path):
    assert read_events(tmp_path) == []
    (tmp_path / "events.jsonl").write_text('{"kind": "a"}\n\0\0\0\n12\n{"kind": "b"}\n{"ki')
    assert [event["kind"] for event in read_events(tmp_path)] == ["a", "b"]


def test_the_reserve_serves_many_last_events_of_a_full_disk(tmp_path, monkeypatch):
    make_reserve(tmp_path)
    log = EventLog(tmp_path, "control")
    write, room = os.write, [0]

    def full(file, data):
        # each part that was given up leaves room for one write
        parts = (tmp_path / RESERVE).stat().st_size // RESERVE_BYTES
        room[0] = RESERVE_PARTS - parts - len(read_events(tmp_path))
        if room[0] <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data)

    monkeypatch.setattr(os, "write", full)
    for k in range(RESERVE_PARTS):
        log.write("stopped", k=k)
    with pytest.raises(OSError, match="No space"):
        log.write("stopped", k=RESERVE_PARTS)
    monkeypatch.undo()
    log.close()
    assert [event["k"] for event in read_events(tmp_path)] == list(range(RESERVE_PARTS))
    drop_reserve(tmp_path)
    assert not (tmp_path / RESERVE).exists()


def test_an_event_that_was_cut_by_a_full_disk_is_written_again(tmp_path, monkeypatch):
    make_reserve(tmp_path)
    log = EventLog(tmp_path, "control")
    log.write("first")
    write, calls = os.write, []

    def full_after_ten_bytes(file, data):
        calls.append(data)
        if len(calls) == 1:
            return write(file, data[:10])
        if len(calls) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data)

    monkeypatch.setattr(os, "write", full_after_ten_bytes)
    log.write("stopped", reason="force")
    monkeypatch.undo()
    log.write("last")
    log.close()
    assert [event["kind"] for event in read_events(tmp_path)] == ["first", "stopped", "last"]


@pytest.mark.punctual  # it says at once whether it lives, and ends at once
def test_a_recorder_lives_without_samples_and_ends_with_main_and_control(recorder, tmp_path):
    beats = []
    deadline = time.monotonic() + 0.6
    while time.monotonic() < deadline:
        beats.append(recorder.board.read(Who.RECORDER).age(host_time()))
        time.sleep(0.005)
    assert np.median(beats) < 0.05
    os.kill(recorder.process.pid, signal.SIGINT)  # as Ctrl-C sends it to all
    recorder.send(0, 100)
    # the time before the first sample does not count
    assert recorder.wait(lambda row: row.count == 100).rate > 100 / 0.6
    recorder.main.close()
    time.sleep(0.5)  # in which control turns a source of liquid back
    recorder.send(100, 105)
    before = recorder.board.read(Who.RECORDER).beat
    recorder.wait(lambda row: row.beat > before + 0.1)
    recorder.samples.close()
    start = time.monotonic()
    recorder.process.join(20)
    assert time.monotonic() - start < 0.5
    assert recorder.process.exitcode == 0
    assert read_csv(tmp_path / SAMPLES, Sample._fields)["index"].tolist() == list(range(105))
    ended, last = read_events(tmp_path)
    assert ended["kind"] == "samples_ended"
    assert (last["source"], last["kind"], last["rows"]) == ("recorder", "left", 105)


def test_a_killed_recorder_loses_nothing_that_it_had_read(recorder, tmp_path):
    rng = np.random.default_rng(0)
    sent = 0
    while sent < 300 + rng.integers(100):
        recorder.send(sent, sent + 5)
        sent += 5
        time.sleep(0.002)
    read = recorder.wait(lambda row: row.count > sent - 50).count
    recorder.process.kill()
    recorder.process.join()
    columns = read_csv(tmp_path / SAMPLES, Sample._fields)
    kept = len(columns["index"])
    assert read <= kept <= sent
    for k in (0, kept - 1):
        np.testing.assert_array_equal([columns[n][k] for n in Sample._fields[3:]], sample(k)[3:])


def test_a_file_that_may_not_grow_is_told_and_samples_are_drained(recorder, tmp_path):
    recorder.send(0, 200)
    recorder.wait(lambda row: row.count == 200)
    size = (tmp_path / SAMPLES).stat().st_size
    resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, (size + 1000, size + 1000))
    recorder.send(200, 2000)
    row = recorder.wait(lambda row: row.trouble)
    assert row.trouble == Trouble.WRITE_FAILED
    recorder.wait(lambda row: row.count == 2000)  # never blocks its sender
    recorder.samples.close()
    recorder.main.close()
    recorder.process.join(20)
    failed, *_, left = read_events(tmp_path)
    assert (failed["kind"], failed["file"]) == ("write_failed", SAMPLES)
    assert "File too large" in failed["reason"]
    assert left["kind"] == "left"
    kept = read_csv(tmp_path / SAMPLES, Sample._fields)["index"]
    assert 200 <= len(kept) < 210
    assert kept.tolist() == list(range(len(kept)))


@pytest.fixture
def small_disk(tmp_path):
    place = tmp_path / "small"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(place)]
    try:
        made = subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        pytest.skip("no mount command")
    if made.returncode:
        pytest.skip(f"a small disk cannot be mounted here: {made.stderr.strip()}")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_full_disk_leaves_the_reason_in_the_events(small_disk):
    make_reserve(small_disk)
    running = Running(small_disk)
    try:
        sent = 0
        while not running.board.read(Who.RECORDER).trouble and sent < 20_000:
            running.send(sent, sent + 100, batch=100)
            sent += 100
        running.samples.close()
        running.main.close()
        running.process.join(20)
    finally:
        running.process.kill()
    failed, *_, left = read_events(small_disk)
    assert (failed["kind"], left["kind"]) == ("write_failed", "left")
    assert "No space left" in failed["reason"]
    kept = read_csv(small_disk / SAMPLES, Sample._fields)["index"]
    assert kept.tolist() == list(range(len(kept)))
    assert len(kept) > 1000


@pytest.mark.slow
def test_memory_and_open_files_do_not_grow(recorder):
    process = Path(f"/proc/{recorder.process.pid}")

    def used():
        pages = int((process / "statm").read_text().split()[1])
        return pages * resource.getpagesize(), len(list((process / "fd").iterdir()))

    recorder.send(0, 10_000, batch=25)
    recorder.wait(lambda row: row.count == 10_000)
    memory, files = used()
    recorder.send(10_000, 60_000, batch=25)  # 8 minutes at 125 Hz
    recorder.wait(lambda row: row.count == 60_000, timeout=60)
    assert used()[1] == files
    assert used()[0] - memory < 2e6
