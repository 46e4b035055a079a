"""One command at a time works in a RUN directory, and a refused one leaves nothing behind."""

import errno
import json
import os
import signal
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.inference.simulations.bank import Simulation

import bolfi_liquids as bl
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.settings import (
    CalibrationSettings,
    CriticismSettings,
    PourSettings,
    SbcSettings,
)
from bolfi_liquids.online.settings import OnlineSettings
from bolfi_liquids.run.directory import (
    RUN_TOML,
    SIMULATIONS,
    check_resumable,
    enter_run,
    open_bank,
    read_run,
)
from bolfi_liquids.run.entering import LOCK, entered, working_in

RECORD = {"settings": {"budget": 20, "seed": 0}, "inputs": {"sha256": ["ab"]}}


def bundled(name):
    return Path(str(files("bolfi_liquids.data"))) / name


TWINS = """
import json, os, sys
from multiprocessing import get_context
from pathlib import Path
from bolfi_liquids.errors import InputError
from bolfi_liquids.run.directory import enter_run
from bolfi_liquids.run.entering import entered

def enter(run, me, how, both_tried):
    record = {"settings": {"seed": me if how != "resumed" else 0}}
    if how == "without locks":
        return enter_run(run, record, resume=False)
    with entered(run, record, resume=how == "resumed"):
        both_tried.wait()

def twin(me, folder, count, how, together, both_tried, answers):
    told = []
    for number in range(count):
        together.wait()
        try:
            enter(folder / f"run_{number}", me, how, both_tried)
            told.append("")
        except InputError as err:
            told.append(str(err))
        if told[-1] or how == "without locks":
            both_tried.wait()
        together.wait()  # the first has left
    answers.put((me, os.getpid(), told))

if __name__ == "__main__":
    folder, count, how = Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    if how == "resumed":
        for number in range(count):
            enter_run(folder / f"run_{number}", {"settings": {"seed": 0}}, resume=False)
    spawn = get_context("spawn")
    together, both_tried = (spawn.Barrier(2, timeout=300) for _ in range(2))
    answers = spawn.Queue()
    twins = [
        spawn.Process(target=twin, args=(me, folder, count, how, together, both_tried, answers))
        for me in (1, 2)
    ]
    for one in twins:
        one.start()
    print(json.dumps([answers.get(timeout=300) for _ in twins]))
    for one in twins:
        one.join()
"""


def twin_starts(folder, count, how):
    """What two processes were told that `count` times entered one directory at the same moment."""
    script = folder / "twins.py"
    script.write_text(TWINS)
    command = [sys.executable, str(script), str(folder), str(count), how]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("count", [12, pytest.param(200, marks=pytest.mark.slow)])
@pytest.mark.parametrize("how", ["new", "resumed", "without locks"])
def test_of_two_commands_that_start_together_exactly_one_enters(tmp_path, how, count):
    """Without locks, as on a disk that has none, run.toml alone keeps the second one out."""
    (me, mine, told), (other, its, heard) = twin_starts(tmp_path, count, how)
    assert len(told) == len(heard) == count
    for number, (one, two) in enumerate(zip(told, heard, strict=True)):
        assert (one == "") != (two == ""), (one, two)
        run = tmp_path / f"run_{number}"
        assert [path.name for path in run.iterdir()] == [RUN_TOML]  # no lock and no half file
        winner, pid = (me, mine) if one == "" else (other, its)
        if how != "resumed":
            assert read_run(run) == {"settings": {"seed": winner}}
        refusal = one or two
        assert str(run) in refusal and "resume" in refusal
        if how != "without locks":
            assert f"process {pid} on " in refusal and " since 20" in refusal


HOLDER = """
import sys, time
from pathlib import Path
from bolfi_liquids.run.entering import entered

with entered(Path(sys.argv[1]), {"settings": {"seed": 0}}, resume=False):
    print("entered", flush=True)
    time.sleep(600.0)
"""


def test_what_a_killed_command_leaves_can_be_gone_on_with(tmp_path):
    run, record = tmp_path / "run", {"settings": {"seed": 0}}
    command = [sys.executable, "-c", HOLDER, str(run)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline().strip() == "entered"
        for resume in (False, True):
            with pytest.raises(InputError, match=f"process {holder.pid} on .*--resume"):
                with entered(run, record, resume=resume):
                    raise AssertionError("two are in it")
        os.kill(holder.pid, signal.SIGKILL)
        holder.wait()
    assert (run / LOCK).exists()  # it says who, and locks nobody out
    with pytest.raises(InputError, match=r"holds a run already.*`resume`"):
        with entered(run, record, resume=False):
            raise AssertionError("it was begun anew")
    with entered(run, record, resume=True) as removed:
        assert removed == []
    assert [path.name for path in run.iterdir()] == [RUN_TOML]


def test_one_process_keeps_itself_out_too(tmp_path):
    with working_in(tmp_path / "out"):
        with pytest.raises(InputError, match=f"process {os.getpid()} on "):
            with working_in(tmp_path / "out"):
                raise AssertionError("two are in it")
    with working_in(tmp_path / "out"):
        pass
    assert not (tmp_path / "out").exists()  # which it made, and left empty


@pytest.mark.parametrize("removed_by", ["mkdir of its parent", "a look whether it is there"])
def test_a_directory_that_vanishes_while_it_is_made_is_made_again(
    tmp_path, monkeypatch, removed_by
):
    """As `Path.mkdir` fails where another command removes what it has just made or found."""
    errors = [FileNotFoundError if removed_by.startswith("mkdir") else FileExistsError]
    made = Path.mkdir

    def mkdir(self, *given, **named):
        if errors:
            raise errors.pop()("removed meanwhile")
        made(self, *given, **named)

    monkeypatch.setattr(Path, "mkdir", mkdir)
    with working_in(tmp_path / "a" / "b"):
        assert (tmp_path / "a" / "b" / LOCK).exists()
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_directory_is_refused_at_once(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    for out in ("file", "file/below", "dangling", "dangling/below"):
        with pytest.raises(InputError, match="not a directory"):
            with working_in(tmp_path / out):
                raise AssertionError("it was entered")
    assert {path.name for path in tmp_path.iterdir()} == {"file", "dangling"}
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there")
    with working_in(tmp_path / "link" / "run"):
        assert (tmp_path / "there" / "run" / LOCK).exists()


def test_others_of_the_group_may_lock_whatever_the_umask(tmp_path):
    before = os.umask(0o077)
    try:
        with working_in(tmp_path / "run"):
            assert (tmp_path / "run" / LOCK).stat().st_mode & 0o666 == 0o666
    finally:
        os.umask(before)


@pytest.mark.parametrize("error", [InputError("no", where="there", fix="do"), OSError("no worker")])
def test_a_refusal_before_the_first_simulation_leaves_nothing(tmp_path, error):
    run = tmp_path / "runs" / "mine"
    with pytest.raises(type(error)), entered(run, RECORD, resume=False):
        (run / "recordings").mkdir()
        (run / "recordings" / "1-stir.nc").touch()
        with open_bank(run):
            raise error
    assert list(tmp_path.iterdir()) == []
    run.mkdir(parents=True)
    (run / "notes.txt").touch()
    (run / "recordings").mkdir()
    (run / "recordings" / "precious.nc").touch()
    with pytest.raises(type(error)), entered(run, RECORD, resume=False):
        (run / "recordings" / "1-stir.nc").touch()
        raise error
    left = {str(path.relative_to(run)) for path in run.rglob("*") if path.is_file()}
    assert left == {"notes.txt", "recordings/precious.nc"}


def test_a_run_that_a_full_disk_ended_can_be_resumed(tmp_path):
    run = tmp_path / "mine"
    with pytest.raises(OSError), entered(run, RECORD, resume=False):
        raise OSError(errno.ENOSPC, "full")
    with entered(run, RECORD, resume=True):
        pass


@pytest.mark.parametrize("error", [InputError("no", where="there", fix="do"), KeyboardInterrupt()])
def test_what_was_simulated_or_interrupted_is_kept(tmp_path, error):
    run = tmp_path / "run"
    with pytest.raises(type(error)), entered(run, RECORD, resume=False):
        if not isinstance(error, KeyboardInterrupt):
            with open_bank(run) as bank:
                bank.put("stir", {}, 0, Simulation(np.zeros(1), None, 1.0))
        raise error
    assert read_run(run) == RECORD
    with entered(run, RECORD, resume=True):
        pass


def test_a_resumed_run_that_is_refused_stays_as_it_was(tmp_path):
    enter_run(tmp_path, RECORD, resume=False)
    for record, resume in ((RECORD, False), ({**RECORD, "settings": {"seed": 1}}, True)):
        with pytest.raises(InputError), entered(tmp_path, record, resume=resume):
            raise AssertionError("it was let in")
    with pytest.raises(ValueError, match="later"), entered(tmp_path, RECORD, resume=True):
        raise ValueError("later")
    assert read_run(tmp_path) == RECORD
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / SIMULATIONS).write_bytes(b"precious")
    with pytest.raises(InputError, match="without run.toml"):
        with entered(tmp_path / "other", RECORD, resume=True):
            raise AssertionError("it was let in")
    assert (tmp_path / "other" / SIMULATIONS).read_bytes() == b"precious"


def test_resuming_where_no_run_is_names_the_nearest(tmp_path):
    for name in ("mine", "yours_of_monday"):
        enter_run(tmp_path / name, RECORD, resume=False)
    with pytest.raises(InputError, match="no run to resume") as caught:
        check_resumable(tmp_path / "mien")
    assert str(tmp_path / "mine") in caught.value.fix and "yours" not in caught.value.fix
    with pytest.raises(InputError) as caught:
        check_resumable(tmp_path)  # the directory of all runs
    assert str(tmp_path) in caught.value.fix
    for other in ("nothing_like_them", "mine/elsewhere/far"):
        with pytest.raises(InputError, match="; to begin a new run"):
            check_resumable(tmp_path / other)
    check_resumable(tmp_path / "mine")


def test_a_recording_whose_copy_would_have_too_long_a_name_is_refused_first(
    short_recording, settings, tmp_path
):
    long = tmp_path / f"{'a' * 245}.nc"
    long.write_bytes(Path(short_recording).read_bytes())
    with pytest.raises(InputError, match="248 bytes"):
        bl.calibrate(long, out=tmp_path / "run", progress=False, **settings)
    assert not (tmp_path / "run").exists()


def given_nothing(out):
    """Each function that writes, with `out` for its path."""
    from bolfi_liquids.checks.physics import check_physics
    from bolfi_liquids.checks.sbc import check_sbc
    from bolfi_liquids.demo import run_demo
    from bolfi_liquids.inputs import rigs, table_import

    stir = bundled("glycerin_v10.nc")
    return {
        "calibrate": lambda: bl.calibrate(stir, out=out, progress=False),
        "check physics": lambda: check_physics(out, progress=False),
        "check sbc": lambda: check_sbc(out, progress=False),
        "demo": lambda: run_demo(out),
        "record": lambda: bl.record(out=out, emulate=True, progress=False),
        "simulate stir": lambda: bl.simulate_stir(out=out, progress=False),
        "simulate pour": lambda: bl.simulate_pour(movie=out, progress=False),
        "import": lambda: bl.import_table(stir, "columns.toml", out),
        "import --template": lambda: table_import.write_template(out),
        "rig template": lambda: rigs.write_template(out),
    }


@pytest.mark.parametrize("function", given_nothing(""))
@pytest.mark.parametrize("out", ["", " "])
def test_an_empty_path_is_not_the_current_directory(monkeypatch, tmp_path, function, out):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="is empty"):
        given_nothing(out)[function]()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "settings", [CalibrationSettings, SbcSettings, PourSettings, CriticismSettings, OnlineSettings]
)
def test_seeds_are_those_that_every_generator_takes(settings):
    for seed in (0, 2**31 - 1, np.int64(7), np.uint8(7), np.array(7)):
        assert type(settings(seed=seed).seed) is int
    for seed in (-1, 2**31, 2**80, np.uint64(2**63), 1.0, "7", True, None):
        with pytest.raises(InputError, match="seed"):
            settings(seed=seed)


def test_a_lock_that_is_a_link_is_not_followed(tmp_path):
    other = tmp_path / "somebody's"
    other.write_text("kept", encoding="utf-8")
    run = tmp_path / "run"
    run.mkdir()
    (run / LOCK).symlink_to(other)
    with pytest.raises(OSError, match="run.lock"), working_in(run):
        pass
    assert other.read_text(encoding="utf-8") == "kept"
