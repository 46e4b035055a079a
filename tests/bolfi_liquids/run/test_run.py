"""A run is never overwritten, goes on with its own settings alone, and its results are current."""

import copy
import json
import os
import shutil
import signal
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
import tomli_w
from bolfi_liquids.inference.simulations.bank import Simulation
from bolfi_liquids.models import effects
from xarray import Dataset, DataTree

import bolfi_liquids as bl
from bolfi_liquids.errors import InputError
from bolfi_liquids.reporting.warnings import Results
from bolfi_liquids.run.results import read_result, write_result
from bolfi_liquids.run.run import (
    LOCK,
    RESULTS,
    RUN_TOML,
    SIMULATIONS,
    Run,
    alone_in,
    check_resumable,
)

RECORD = {
    "created": "2026-01-01T00:00:00+00:00",
    "settings": {"budget": 20, "seed": 0, "prior": {"viscosity": {"family": "Uniform"}}},
    "simulator": {"recording_1": {"particles": 1000, "cup": {"radius": 0.04}}},
    "inputs": {"sha256": ["ab"]},
    "versions": {"numpy": "2.0"},
}


def begin(path, record=RECORD, *, resume=False, ends=()):
    with Run.begun(path, record, resume=resume, ends=ends) as run:
        return run


def changed(section, **fields):
    """`RECORD` with other fields in one section."""
    other = copy.deepcopy(RECORD)
    other[section] |= fields
    return other


def written(path):
    return (path / RUN_TOML).read_bytes()


def test_a_run_is_not_overwritten(tmp_path):
    run = tmp_path / "a" / "run"
    begin(run)
    before = written(run)
    with pytest.raises(InputError, match="holds a run already.*`resume`"):
        begin(run)
    assert written(run) == before


@pytest.mark.parametrize(
    ("section", "field", "value"),
    [
        ("settings", "seed", 1),
        ("simulator", "recording_1", {"particles": 500, "cup": {"radius": 0.04}}),
        ("inputs", "sha256", ["cd"]),
    ],
)
def test_a_run_goes_on_with_its_own_settings_alone(tmp_path, section, field, value):
    begin(tmp_path)
    before = written(tmp_path)
    with pytest.raises(InputError) as refused:
        begin(tmp_path, changed(section, **{field: value}), resume=True)
    assert section == "inputs" or f"{section}.{field}" in str(refused.value)
    assert written(tmp_path) == before


def test_dates_and_versions_may_be_others(tmp_path):
    begin(tmp_path)
    later = RECORD | {"created": "2027-01-01T00:00:00+00:00", "versions": {"numpy": "3.0"}}
    assert begin(tmp_path, later, resume=True).record == RECORD


def test_a_run_grows_in_the_field_that_may_grow(tmp_path):
    begin(tmp_path)
    larger, ends = changed("settings", budget=30), ("settings.budget",)
    with pytest.raises(InputError, match=r"settings\.budget is 20 in the run, but 30"):
        begin(tmp_path, larger, resume=True)
    grown = begin(tmp_path, larger, resume=True, ends=ends)
    assert grown.record == larger
    assert Run.open(tmp_path).record == RECORD  # as long as there is no larger result
    with pytest.raises(InputError):
        begin(tmp_path, changed("settings", budget=40, seed=1), resume=True, ends=ends)
    draws = DataTree.from_dict({"/posterior": Dataset({"x": ("draw", [1.0])})})
    grown.keep("calibrate", draws, grown.made_from, {})
    assert Run.open(tmp_path).record == larger
    with pytest.raises(InputError):
        begin(tmp_path, RECORD, resume=True, ends=ends)


def test_results_without_settings_are_left_alone(tmp_path):
    for name in (SIMULATIONS, *RESULTS.values()):
        (tmp_path / name).write_bytes(b"precious")
        with pytest.raises(InputError, match=f"holds {name} without run.toml"):
            begin(tmp_path, resume=True)
        assert (tmp_path / name).read_bytes() == b"precious"
        (tmp_path / name).unlink()


LOST = {
    "no TOML": lambda whole: b'created = "\xe9"',
    "cut before its settings": lambda whole: whole[: whole.index(b"\n[settings]")],
    "cut before its versions": lambda whole: whole[: whole.index(b"[versions]")],
    "removed": lambda whole: None,
}


@pytest.mark.parametrize("how", LOST)
def test_whose_record_is_lost_is_calibrated_anew_on_its_own_recordings(run, how):
    file, copies = run.path / RUN_TOML, [str(one) for one in (run.path / "recordings").iterdir()]
    if (left := LOST[how](file.read_bytes())) is None:
        file.unlink()
    else:
        file.write_bytes(left)
    for read in (bl.Calibration.open, bl.choose_pour):
        with pytest.raises(InputError) as refused:
            read(run.path)
        assert refused.value.where == str(run.path if left is None else file)
        *_, anew = refused.value.fix.partition("bolfi-liquids ")
        assert anew.split() == ["calibrate", *copies, "--out", f"{run.path}_anew"]


def test_what_is_no_run_has_no_result_and_says_what_makes_one(tmp_path):
    begin(tmp_path)
    with pytest.raises(InputError, match="not finished; run: bolfi-liquids calibrate RECORDING"):
        bl.choose_pour(tmp_path)


def test_simulations_that_were_removed_are_missed(run, short_recording, settings, caplog):
    (run.path / SIMULATIONS).unlink()
    bl.calibrate(short_recording, out=run.path, resume=True, progress=False, **settings)
    bl.report(run.path, moving=False, progress=False)
    with run.bank() as bank:
        assert len(bank) == 0
    told = [one.getMessage() for one in caplog.records if SIMULATIONS in one.getMessage()]
    assert len(told) == 3


def test_resuming_where_no_run_is_names_the_nearest(tmp_path):
    for name in ("mine", "yours_of_monday"):
        begin(tmp_path / name)
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


TWINS = """
import sys
from multiprocessing import get_context
from pathlib import Path
from bolfi_liquids.errors import InputError
from bolfi_liquids.run.run import Run

def twin(folder, count, together, answers):
    told = []
    for number in range(count):
        together.wait()
        try:
            with Run.begun(folder / f"run_{number}", {"settings": {}}, resume=False):
                told.append("")
                together.wait()  # until the other was refused
        except InputError as error:
            told.append(str(error))
            together.wait()
    answers.put(told)

if __name__ == "__main__":
    spawn = get_context("spawn")
    together, answers = spawn.Barrier(2, timeout=300), spawn.Queue()
    given = Path(sys.argv[1]), int(sys.argv[2]), together, answers
    twins = [spawn.Process(target=twin, args=given) for _ in range(2)]
    for one in twins:
        one.start()
    for one, other in zip(*(answers.get(timeout=300) for _ in twins)):
        print(sorted([one, other]))
"""


@pytest.mark.parametrize("count", [5, pytest.param(200, marks=pytest.mark.slow)])
def test_of_two_commands_that_start_together_exactly_one_enters(tmp_path, count):
    script = tmp_path / "twins.py"
    script.write_text(TWINS, encoding="utf-8")
    command = [sys.executable, str(script), str(tmp_path), str(count)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert len(lines) == count
    for number, line in enumerate(lines):
        assert line.startswith("['', ") and f"run_{number}: " in line
        assert (tmp_path / f"run_{number}" / RUN_TOML).exists()


HOLDER = """
import sys, time
from pathlib import Path
from bolfi_liquids.reporting.warnings import Results
from bolfi_liquids.run.run import alone_in

with alone_in(Path(sys.argv[1])):
    print("entered", flush=True)
    time.sleep(600.0)
"""


def test_a_lock_ends_with_its_process(tmp_path):
    run = tmp_path / "run"
    begin(run)
    command = [sys.executable, "-c", HOLDER, str(run)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline().strip() == "entered"
        with pytest.raises(InputError, match="another command works in it"):
            begin(run, resume=True)
        os.kill(holder.pid, signal.SIGKILL)
        holder.wait()
    assert (run / LOCK).exists()  # it locks nobody out
    assert begin(run, resume=True).record == RECORD


def test_what_is_no_directory_is_refused_at_once(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    for out in ("file", "file/below", "dangling"):
        with pytest.raises(InputError, match="not a directory"):
            with alone_in(tmp_path / out):
                raise AssertionError("it was entered")


def test_what_was_simulated_is_kept_when_a_command_fails(tmp_path):
    with pytest.raises(KeyboardInterrupt), Run.begun(tmp_path, RECORD, resume=False) as run:
        with run.bank() as bank:
            bank.put("stir", {}, 0, Simulation(np.zeros(1), None, 1.0))
        raise KeyboardInterrupt
    with begin(tmp_path, resume=True).bank() as bank:
        assert len(bank) == 1


# results


@pytest.fixture
def run(calibration, tmp_path):
    """A copy of a calibrated run."""
    return Run.open(shutil.copytree(calibration.path, tmp_path / "run"))


def rewritten(run, change):
    """The run after its run.toml was changed by hand."""
    record = copy.deepcopy(dict(run.record))
    change(record)
    (run.path / RUN_TOML).write_text(tomli_w.dumps(record), encoding="utf-8")
    return run.path


def poured(run, after, given=""):
    """Compute a result as `pour` keeps one."""
    tree = run.required("calibrate").copy()
    run.keep("pour", tree, {"after": after, "given": given}, {"distance_cm": 2.0})


def test_a_result_is_current_as_long_as_what_it_was_made_from_is_there(run):
    assert run.result("pour") is None and run.why_not("pour") == ""
    poured(run, run.posterior_key())
    assert run.result("pour") is not None
    poured(run, "of another posterior")
    assert run.result("pour") is None and "posterior" in run.why_not("pour")
    poured(run, run.posterior_key(), given="of other pours")
    assert run.result("pour") is None and "given pours" in run.why_not("pour")
    with pytest.raises(InputError, match="given pours.*; run.*: bolfi-liquids pour "):
        run.required("pour")


def test_summary_has_the_sections_of_what_is_current(run):
    before = json.loads((run.path / "summary.json").read_text(encoding="utf-8"))
    poured(run, run.posterior_key())
    summary = json.loads((run.path / "summary.json").read_text(encoding="utf-8"))
    assert summary == before | {"pour": {"distance_cm": 2.0}}
    (run.path / "summary.json").write_text("{", encoding="utf-8")  # nothing reads it
    assert bl.Calibration.open(run.path).summary.to_json() == before["calibrate"]


def test_a_posterior_of_other_settings_is_not_current(run):
    path = rewritten(run, lambda record: record["settings"].update(seed=99))
    with pytest.raises(InputError, match="other settings than run.toml holds.*--resume"):
        bl.Calibration.open(path)


@pytest.mark.parametrize("part", ["model", "engine"])
def test_a_run_of_another_generation_is_refused_with_the_way_out(run, part):
    def change(record):
        table = record["simulator"]["recording_1"] if part == "model" else record["engine"]
        table["model" if part == "model" else "version"] = "0"

    path = rewritten(run, change)
    execute = partial(bl.execute_pour, emulate=True)
    for read in (bl.Calibration.open, bl.criticise, bl.choose_pour, bl.report, execute):
        with pytest.raises(InputError, match=f"made by {part} 0.*calibrate again: ") as refused:
            read(path)
        assert "recordings/1-short.nc" in refused.value.fix


def test_every_byte_of_a_result_counts(run, tmp_path):
    tree, path = run.required("calibrate"), tmp_path / "tree.nc"
    write_result(tree, path)
    whole = path.read_bytes()
    for at in np.random.default_rng(0).integers(0, len(whole), 40):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        with pytest.raises(ValueError, match="damaged"):
            read_result(path)
    path.write_bytes(whole)
    assert read_result(path).identical(tree)


def test_what_a_caller_changes_is_its_own(run):
    first = run.required("calibrate")
    first["posterior"]["viscosity"].values[:] = 0.0
    again = Run.open(run.path).required("calibrate")
    assert (again["posterior"]["viscosity"] > 0.0).all()


def test_an_altered_copy_of_a_recording_is_written_again(run, short_recording, settings):
    (copy,) = (run.path / "recordings").iterdir()
    whole = copy.read_bytes()
    copy.write_bytes(whole[:-1])
    bl.calibrate(short_recording, out=run.path, resume=True, progress=False, **settings)
    assert copy.read_bytes() == whole


def test_no_pour_counts_beside_a_damaged_criticism_which_is_made_again_first(run):
    poured(run, run.posterior_key())
    (run.path / RESULTS["criticise"]).write_bytes(b"cut off")
    assert run.result("pour") is None
    with pytest.raises(InputError, match=r"criticism\.nc is damaged.*bolfi-liquids criticise"):
        run.required("pour")


def test_what_an_accepted_effect_of_ones_own_made_is_current_with_its_files_alone(
    run, keep_criticism, made_from, monkeypatch
):
    """Where the effect is not known, what was made with it can still be read."""
    own = {}
    monkeypatch.setattr(effects, "own_effects", lambda: own)
    made_from["considered"] = [["camera_delay first", "camera_tilt"], []]
    keep_criticism(run.path)
    tree = run.required("calibrate").copy()
    from_effects = {"after": run.posterior_key(), "given": "", "effects": ["camera_delay first"]}
    run.keep("pour", tree, from_effects, {"distance_cm": 2.0})
    for digest, current in ((None, True), ("first", True), ("second", False)):
        own.update({} if digest is None else {"camera_delay": digest, "other": "second"})
        assert [(run.result(step) is not None) for step in ("criticise", "pour")] == [current] * 2
    assert "other files of the effect camera_delay" in run.why_not("pour")
    with pytest.raises(InputError, match="effect camera_delay.*bolfi-liquids criticise"):
        run.required("pour")
    made_from["considered"] = [["camera_delay second"], []]
    keep_criticism(run.path)  # anew, and its draws are the same
    assert "pour.nc was made with other files of the effect" in run.why_not("pour")


def test_results_are_those_of_now(run, keep_criticism):
    assert Results.of(run).criticism is None and run.result("criticise") is None
    keep_criticism(run.path)  # by another command
    assert Results.of(run).criticism is not None


def test_a_run_that_grows_keeps_its_summary(run, short_recording, settings, monkeypatch):
    def killed(*_):
        raise KeyboardInterrupt

    before = (run.path / "summary.json").read_bytes()
    monkeypatch.setattr("bolfi_liquids.calibration.calibrate._calibrate", killed)
    with pytest.raises(KeyboardInterrupt):
        bl.calibrate(short_recording, out=run.path, resume=True, **settings | {"budget": 12})
    assert (run.path / "summary.json").read_bytes() == before
    assert Run.open(run.path).result("calibrate") is not None
