"""Whatever writes into a run keeps others out of it, so that nothing of either is lost."""

from importlib.resources import files
from pathlib import Path

import pytest
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.cli.app import app
from bolfi_liquids.errors import InputError
from bolfi_liquids.run.run import LOCK, RUN_TOML, Run, alone_in

RECORD = {
    "settings": {"budget": 20, "seed": 0},
    "inputs": {"sha256": ["ab"]},
    "versions": {"numpy": "2.0"},
}


def commands_in(run):
    """Every call that writes into a run, and what is typed for it."""
    stir = Path(str(files("bolfi_liquids.data"))) / "glycerin_v10.nc"
    return {
        "calibrate": (
            lambda: bl.calibrate(stir, out=run, resume=True, progress=False),
            ["calibrate", str(stir), "--out", str(run), "--resume"],
        ),
        "criticise": (lambda: bl.criticise(run, progress=False), ["criticise", str(run)]),
        "pour": (lambda: bl.choose_pour(run, progress=False), ["pour", str(run)]),
        "report": (lambda: bl.report(run, progress=False), ["report", str(run)]),
        "execute": (
            lambda: bl.execute_pour(run, emulate=True, progress=False),
            ["pour", str(run), "--execute", "--emulator"],
        ),
    }


def contents(run):
    return {path.name: path.read_bytes() for path in run.iterdir() if path.is_file()}


@pytest.mark.parametrize("command", commands_in(Path()))
def test_what_writes_into_a_run_keeps_out_while_another_command_works_there(tmp_path, command):
    run = tmp_path / "run"
    with Run.begun(run, RECORD, resume=False):
        pass
    call, typed = commands_in(run)[command]
    with alone_in(run):
        before = contents(run)
        with pytest.raises(InputError, match="another command works in it") as refused:
            call()
        assert refused.value.where == str(run)
        result = CliRunner().invoke(app, typed)
        assert result.exit_code == 2
        (line,) = result.stderr.strip().splitlines()
        assert "another command works in it" in line
        assert contents(run) == before
    assert contents(run).keys() == {RUN_TOML, LOCK}


def test_a_mistyped_run_is_not_made(tmp_path):
    calls = commands_in(tmp_path / "runs" / "mien")
    del calls["calibrate"]
    for call, _ in calls.values():
        with pytest.raises(InputError, match="mien"):
            call()
    assert list(tmp_path.iterdir()) == []
