"""The runner of validation cases, on cases that take no time."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
import xml.etree.ElementTree as ET
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from types import ModuleType

import numpy as np
import pytest
from bolfi_liquids.models.validation import Case, CaseResult, Curve, Panel, Row
from typer.testing import CliRunner

from bolfi_liquids.checks import physics, physics_records
from bolfi_liquids.checks.physics import all_cases, check_physics
from bolfi_liquids.cli.app import app
from bolfi_liquids.errors import InputError


def outcome(error=0.01):
    x = np.linspace(1, 2, 5)
    curves = (Curve("truth", x, x, truth=True), Curve("ours", x, x + error))
    rows = (Row.relative("mass [kg]", 2.0, 2.0 * (1 + error), 0.05),)
    return CaseResult(rows, (Panel("time [s]", "mass [kg]", curves, log="xy"),), {"n": np.int64(3)})


def fake(name, run, **settings):
    return Case(name, f"The {name} one", "mass stays", "Lavoisier", "relative", 0.05, settings, run)


@pytest.fixture
def calls():
    return []


@pytest.fixture
def registry(calls):
    def good(progress, seed):
        calls.append(("good", seed))
        progress(0.5)
        return outcome()

    def bad(progress, seed):
        calls.append(("bad", seed))
        return outcome(error=0.2)

    return {"good": fake("good", good), "bad": fake("bad", bad)}


def run(out, registry, names=(), **more):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(physics, "all_cases", lambda: registry)
        return check_physics(out, names, progress=False, **more)


@pytest.mark.usefixtures("drawn")
def test_a_check_leaves_table_rows_plots_and_one_results_file(tmp_path, registry):
    check = run(tmp_path / "out", registry, seed=4)
    assert not check.passed
    assert [record["passed"] for record in check.records] == [True, False]
    results = json.loads(check.results.read_text())
    assert results["seed"] == 4 and results["passed"] is False
    assert results["version"] and results["model"] and results["versions"]["numpy"]
    row = results["cases"]["bad"]["rows"][0]
    assert row["error"] == pytest.approx(0.2) and row["tolerance"] == 0.05
    assert results["cases"]["good"]["notes"] == {"n": 3}
    for name in registry:
        svg = ET.parse(tmp_path / "out" / f"{name}.svg").getroot()
        assert svg.tag.endswith("svg")
        assert f"The {name} one" in "".join(svg.itertext())


@pytest.mark.usefixtures("drawn")
def test_a_finished_case_is_not_repeated(tmp_path, registry, calls):
    first = run(tmp_path, registry)
    plot = (tmp_path / "good.svg").read_text()
    (tmp_path / "good.svg").unlink()  # as if killed between record and plot
    second = run(tmp_path, registry)
    assert calls == [("good", 0), ("bad", 0)]
    assert first.ran == ("good", "bad") and second.ran == ()
    assert second.records == first.records
    assert (tmp_path / "good.svg").read_text() == plot


@pytest.mark.parametrize("change", ["seed", "settings", "model", "version"])
def test_other_settings_run_again(tmp_path, registry, calls, change, monkeypatch):
    run(tmp_path, registry, ["good"])
    if change == "seed":
        check = run(tmp_path, registry, ["good"], seed=1)
    elif change == "settings":
        check = run(tmp_path, {"good": fake("good", registry["good"].run, particles=9)})
    elif change == "version":
        monkeypatch.setattr(physics_records, "versions", lambda names: {"bolfi-liquids": "9"})
        check = run(tmp_path, registry, ["good"])
    else:
        monkeypatch.setattr("bolfi_liquids.models.MODEL_VERSION", "another")
        check = run(tmp_path, registry, ["good"])
    assert check.ran == ("good",) and len(calls) == 2


def test_a_tighter_tolerance_is_not_met_by_a_record_of_a_wider_one(tmp_path, registry):
    def off(progress, seed):
        return replace(outcome(), rows=(Row.absolute("q", 1.0, 1.5, case.tolerance),))

    case = replace(registry["good"], tolerance=0.9, run=off)
    assert run(tmp_path, {"good": case}).passed
    case = replace(case, tolerance=0.1)
    check = run(tmp_path, {"good": case})
    assert check.ran == ("good",) and not check.passed


def test_changed_code_of_a_case_runs_again(tmp_path, registry, monkeypatch):
    source = tmp_path / "own_case.py"
    source.write_text("TOLERANCE = 0.9\n")
    module = ModuleType("own_case")
    module.__file__ = str(source)
    monkeypatch.setitem(sys.modules, "own_case", module)

    def good(progress, seed):
        return outcome()

    good.__module__ = "own_case"
    cases = {"good": fake("good", good)}
    out = tmp_path / "out"
    assert [run(out, cases).ran for _ in range(2)] == [("good",), ()]
    source.write_text("TOLERANCE = 0.1\n")
    assert run(out, cases).ran == ("good",)


def test_the_modules_that_cases_share_belong_to_their_code():
    text = physics_records._shared_code().decode()
    assert "class Case:" in text and "CASE = Case(" not in text


def fine(progress, seed):
    return outcome()


def off(progress, seed):
    return outcome(error=0.2)


def dies(progress, seed):
    os._exit(1)


@pytest.mark.slow
@pytest.mark.usefixtures("importable")
def test_cases_that_an_executor_runs_are_recorded_alike(tmp_path):
    registry = {"good": fake("good", fine), "bad": fake("bad", off)}
    here = run(tmp_path / "here", registry)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        there = run(tmp_path / "there", registry, executor=pool)
    same = ("name", "rows", "notes", "panels", "passed")
    assert there.ran == here.ran
    for one, other in zip(here.records, there.records, strict=True):
        assert {key: one[key] for key in same} == {key: other[key] for key in same}
    assert run(tmp_path / "there", registry).ran == ()


def test_some_cases_are_run_and_all_finished_ones_are_in_the_results(tmp_path, registry):
    run(tmp_path, registry, ["bad"])
    check = run(tmp_path, registry, ["good", "good"])
    assert check.ran == ("good",) and check.passed
    assert set(json.loads(check.results.read_text())["cases"]) == {"good", "bad"}


def test_a_case_that_raises_costs_itself_alone_and_is_tried_again(tmp_path, registry):
    tries = []

    def breaks(progress, seed):
        tries.append(seed)
        if len(tries) == 1:
            raise RuntimeError("neighbour lists\noverflowed")
        return outcome()

    registry = {"breaks": fake("breaks", breaks), **registry}
    first = run(tmp_path, registry)
    assert [record["name"] for record in first.records] == ["breaks", "good", "bad"]
    assert first.records[0]["error"] == "RuntimeError: neighbour lists overflowed"
    assert "in breaks" in first.records[0]["traceback"]
    assert not first.passed and not (tmp_path / "breaks.svg").exists()
    second = run(tmp_path, registry)
    assert second.ran == ("breaks",) and second.records[0]["passed"]
    assert (tmp_path / "breaks.svg").exists()


@pytest.mark.usefixtures("importable")
def test_a_case_that_kills_its_worker_costs_no_other_its_record(tmp_path):
    """Of two cases that one process runs, the first has finished when the second kills it."""
    registry = {name: fake(name, job) for name, job in
                (("first", fine), ("dies", dies), ("waits", fine))}  # fmt: skip
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        first, killed, lost = run(tmp_path, registry, executor=pool).records
    assert first["passed"] and first["error"] is None
    for record in (killed, lost):
        assert record["error"].startswith("BrokenProcessPool") and not record["passed"]
    registry["dies"] = fake("dies", fine)
    assert run(tmp_path, registry).ran == ("dies", "waits")


def test_a_pool_that_is_broken_already_is_recorded(tmp_path, registry):
    pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"))
    pool.shutdown()
    records = run(tmp_path, registry, executor=pool).records
    assert all(record["error"].startswith("RuntimeError") for record in records)


def test_a_case_may_take_so_long(tmp_path, registry):
    from bolfi_liquids.models.runtime import run_chunks

    def long(progress, seed):
        run_chunks(None, 1000, lambda begin, end: time.sleep(0.02), None)
        return outcome()

    registry |= {"long": fake("long", long)}
    records = {one["name"]: one for one in run(tmp_path, registry, timeout=0.01).records}
    assert records["long"]["error"].startswith("TimeLimitExceeded")
    assert records["good"]["passed"]
    assert run(tmp_path, registry).ran == ("long",)


@pytest.mark.slow
def test_a_case_of_liquid_in_a_cup_may_take_so_long(tmp_path):
    check = check_physics(tmp_path, ["ring_couette"], timeout=0.5, progress=False)
    assert check.records[0]["error"].startswith("TimeLimitExceeded")


def test_what_is_no_number_is_kept_as_null_and_fails(tmp_path):
    def diverged(progress, seed):
        panel = Panel("x", "y", (Curve("", [0.0, 1.0], [np.nan, 1.0]),))
        return CaseResult((Row.absolute("speed [m/s]", 1.0, np.nan, 0.5),), (panel,))

    check = run(tmp_path, {"diverged": fake("diverged", diverged)})
    assert check.records[0]["rows"][0]["ours"] is None
    assert not check.passed


def test_interruption_keeps_what_has_finished(tmp_path, registry, calls):
    def interrupted(progress, seed):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, registry | {"long": fake("long", interrupted)})
    assert run(tmp_path, registry).ran == ()


@pytest.mark.slow
def test_a_killed_check_goes_on(tmp_path):
    """SIGKILL in the second case; the first is not run again, the second is."""
    script = tmp_path / "check.py"
    script.write_text(
        textwrap.dedent("""
        import sys, time
        from pathlib import Path
        from bolfi_liquids.models.validation import Case, CaseResult, Curve, Panel, Row
        from bolfi_liquids.checks import physics

        here = Path(sys.argv[1])

        def run(name, sleep):
            def simulate(progress, seed):
                with open(here / "log", "a") as log:
                    log.write(name + "\\n")
                time.sleep(sleep)
                panel = Panel("x", "y", (Curve("", [0], [0]),))
                return CaseResult((Row.absolute("q", 1, 1, 0),), (panel,))
            return Case(name, name, "t", "s", "relative", 0.0, {}, simulate)

        cases = [run("first", 0), run("second", float(sys.argv[2]))]
        physics.all_cases = lambda: {case.name: case for case in cases}
        physics.check_physics(here / "out", progress=False)
        """)
    )
    command = [sys.executable, str(script), str(tmp_path)]
    process = subprocess.Popen([*command, "60"])
    log = tmp_path / "log"
    deadline = time.monotonic() + 60
    while not (log.exists() and "second" in log.read_text()):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    subprocess.run([*command, "0"], check=True)
    assert log.read_text().split() == ["first", "second", "second"]
    assert json.loads((tmp_path / "out" / "physics.json").read_text())["passed"] is True


def test_bad_arguments_are_named(tmp_path, registry):
    with pytest.raises(InputError, match="^names: .*'none'.*good, bad"):
        run(tmp_path / "out", registry, ["none"])
    with pytest.raises(InputError, match="^seed: -1"):
        run(tmp_path / "out", registry, seed=-1)
    assert not (tmp_path / "out").exists()
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="not a directory"):
        run(tmp_path / "file", registry)
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "good.json").write_text("{")
    with pytest.raises(InputError, match=r"good\.json: not JSON.*delete it"):
        run(tmp_path, registry)


def check_on_the_command_line(*arguments):
    return CliRunner().invoke(app, ["check", "physics", *map(str, arguments)])


def test_the_command_prints_the_table_and_its_status(tmp_path, registry, monkeypatch):
    monkeypatch.setattr(physics, "all_cases", lambda: registry)
    failed = check_on_the_command_line("--out", tmp_path)
    assert failed.exit_code == 1
    for text in ("Lavoisier", "mass [kg]", "+20.0%", "5.0%", "FAIL", "pass", "1 of 2"):
        assert text in failed.stdout
    assert f"results: {tmp_path}/physics.json" in failed.stdout
    assert "good (1 of 2)" in failed.stderr
    passed = check_on_the_command_line("--out", tmp_path, "--case", "good")
    assert passed.exit_code == 0
    assert "bad" not in passed.stdout and passed.stderr == ""


def test_the_command_says_what_failed(tmp_path, monkeypatch):
    def breaks(progress, seed):
        raise RuntimeError("overflow [b]")

    monkeypatch.setattr(physics, "all_cases", lambda: {"breaks": fake("breaks", breaks)})
    result = check_on_the_command_line("--out", tmp_path)
    assert result.exit_code == 1
    assert "ERROR" in result.stdout
    assert "breaks failed: RuntimeError: overflow [b]; it is tried again" in result.stdout


def test_misuse_of_the_command_is_one_line(tmp_path):
    result = check_on_the_command_line("--out", tmp_path / "out", "--case", "none")
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith("error: --case: no case 'none'")
    assert CliRunner().invoke(app, ["check", "physics", "--help"]).exit_code == 0


def test_all_cases_are_there_without_starting_taichi():
    code = (
        "import sys; from bolfi_liquids.checks.physics import all_cases; all_cases();"
        "from bolfi_liquids.models import runtime; print(runtime.start.cache_info().currsize,"
        "[m for m in ('jax', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0 []"
    for name, case in all_cases().items():
        assert case.name == name
