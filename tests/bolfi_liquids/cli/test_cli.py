"""The command line as a person meets it."""

import shutil
import sqlite3
import subprocess
import sys
from importlib.resources import files
from typing import Annotated, Literal

import pytest
import typer
from bolfi_liquids.hardware.vision.camera_model import opencv
from typer.main import get_command
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.cli.app import app
from bolfi_liquids.cli.options import ComputeOptions, grouped
from bolfi_liquids.inputs.settings import checked, helped

MAIN = "from bolfi_liquids.cli.app import main; main()"


@pytest.fixture
def stir(tmp_path, monkeypatch):
    """A directory to work in, with a recording stir.nc."""
    monkeypatch.chdir(tmp_path)
    content = (files("bolfi_liquids.data") / "glycerin_v10.nc").read_bytes()
    (tmp_path / "stir.nc").write_bytes(content)
    return tmp_path


REFUSED = {
    "calibrate stir.nc": "--out",
    "calibrate stir.nc --out run --budget ten": "--budget",
    "calibrate stir.nc --out run --frobnicate": "--frobnicate",
    "calibrate stir.nc --out run --budget 6": "--budget: 6;",
    "calibrate stir.nc --out run --surrogate spline": "--surrogate: 'spline';",
    "calibrate stir.nc --out run --cups cups.toml": "--cups: needs --pours",
    "calibrate stir.nc --out run --workers 2 --dask tcp://127.0.0.1:9": "--dask: names another",
    "calibrate stir.nc --out run --liquid oil": "--liquid: needs --pours, which is missing; give",
    "calibrate stir.nc --out run --until a=1 --until=b=2": "--until: is given twice;",
    "calibrate stir.nc --out run --pours a.csv --pours b.csv": "--pours: is given twice;",
    "import table.csv": "--columns: is missing;",
    "calibrate stir.nc --out=": "--out: is empty",
    "criticise run --held-out-pours pours.csv": "--held-out-pours: needs --pours",
    "pour run --iterations 1": "--iterations: 1;",
    "pour run --arm": "--arm: needs --execute",
    "pour run --execute --emulator --arm": "--arm: excludes --emulator;",
    "pour run --execute --budget 64 --cups a.toml": "--budget, --cups: of the choice of a pour",
    "record --out run --viscosity 0": "--viscosity: needs --emulator",
    "record --out run --target 0.05": "--target: needs --calibrate",
    "record --out run --cycles 0": "--cycles: 0;",
    "simulate pour --angular-velocity 0": "--angular-velocity: 0 deg/s;",
    "simulate pour --distance 300": "--distance: 300 cm;",
    "simulate pour --viscosity 1e999": "--viscosity: inf;",
    "simulate pour --out a.csv": "a.csv: ends in '.csv'",
    "simulate stir --effect stick_mass=-1": "--effect stick_mass=-1: -1.0 is no coefficient",
    "simulate stir --effect stick_mass=1_1": "--effect stick_mass=1_1: '1_1'",
    "simulate stir --out run.nc --seed 2147483648": "--seed: 2147483648;",
    "simulate stir --movie a.avi": "a.avi: unknown kind of movie",
    "rig calibrate-cameras --view ab": "'--view': 'ab' is not one of",
    "check sbc --noise-deg -1 --out run": "--noise-deg: -1.0;",
    "guide poetry": "no page 'poetry'",
}
"""What was typed -> how the one line begins that answers."""


@pytest.mark.parametrize("typed", REFUSED)
def test_a_slip_is_named_in_one_line_before_anything_is_written(stir, typed):
    result = CliRunner().invoke(app, typed.split())
    assert (result.exit_code, result.stdout) == (2, "")
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith("error: ") and REFUSED[typed] in line
    assert [path.name for path in stir.iterdir()] == ["stir.nc"]


@pytest.mark.parametrize("empty", [["--out", " "], ["--out="], [""]])
def test_a_variable_that_was_not_set_is_no_path(stir, empty):
    """As a path it would be the current directory."""
    result = CliRunner().invoke(app, ["calibrate", "stir.nc", *empty])
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert ("--out" if "--out" in empty[0] else "argument") in line and "is empty" in line


def test_a_missing_file_is_one_line_and_debug_shows_where(tmp_path):
    command = ["calibrate", str(tmp_path / "none.nc"), "--out", str(tmp_path / "run")]
    plain = CliRunner().invoke(app, command)
    assert plain.stderr == f"error: {tmp_path}/none.nc: no such file; check the path\n"
    debug = subprocess.run(
        [sys.executable, "-c", MAIN, "--debug", *command], capture_output=True, text=True
    )
    assert debug.returncode == 2
    assert "Traceback" in debug.stderr and "open_recording" in debug.stderr


def test_a_missing_extra_is_named(stir, monkeypatch):
    opencv.cache_clear()  # an earlier test of this process may have imported it
    monkeypatch.setitem(sys.modules, "cv2", None)
    result = CliRunner().invoke(app, ["rig", "calibrate-cameras", "--print-board", "board.png"])
    assert result.exit_code == 2 and "pip install 'bolfi-liquids[" in result.stderr


def test_a_group_without_a_command_shows_its_help():
    for group in ([], ["rig"], ["check"], ["simulate"]):
        result = CliRunner().invoke(app, group)
        assert (result.exit_code, result.stderr) == (2, "")
        assert result.stdout == CliRunner().invoke(app, [*group, "--help"]).stdout


@pytest.mark.parametrize(
    ("file", "command", "advice"),
    [("posterior.nc", "report", "--resume"), ("simulations.sqlite", "pour", "another --out")],
)
def test_damaged_files_are_named(calibration, tmp_path, file, command, advice):
    run = shutil.copytree(calibration.path, tmp_path / "run")
    whole = (run / file).read_bytes()
    (run / file).write_bytes(whole[: len(whole) // 3])
    result = CliRunner().invoke(app, [command, str(run)])
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert file in line and advice in line


def test_a_bank_damaged_within_is_named(calibration, tmp_path):
    run = shutil.copytree(calibration.path, tmp_path / "run")
    connection = sqlite3.connect(run / "simulations.sqlite")
    connection.executescript("DROP TABLE simulation; CREATE TABLE simulation (x)")
    connection.close()
    result = CliRunner().invoke(app, ["pour", str(run)])
    assert result.exit_code == 2
    *_, line = result.stderr.strip().splitlines()  # after that of the progress
    assert "simulations.sqlite" in line


def test_interruption_says_how_to_go_on(monkeypatch, stir):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    recording = (stir / "stir.nc").rename(stir / "stir me.nc")
    (stir / "run.toml").touch()  # as soon as it is there, a run has begun
    command = ["calibrate", str(recording), "--out", str(stir)]
    monkeypatch.setattr("bolfi_liquids.calibration.calibrate.calibrate", interrupt)
    monkeypatch.setattr(sys, "argv", ["bolfi-liquids", *command])
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 130
    assert f"bolfi-liquids calibrate '{recording}' --out {stir} --resume" in result.stderr


STOPPED = """
import os, signal, sys, time
from bolfi_liquids.calibration import calibrate
from bolfi_liquids.cli.app import main

def stop_this_process(*_, **__):
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(60.0)

calibrate.calibrate = stop_this_process
main()
"""


def test_a_command_that_is_terminated_says_how_to_go_on(short_recording, tmp_path):
    (tmp_path / "run.toml").touch()
    command = ["calibrate", str(short_recording), "--out", str(tmp_path)]
    done = subprocess.run([sys.executable, "-c", STOPPED, *command], capture_output=True, text=True)
    assert done.returncode == 130
    assert f"--out {tmp_path} --resume" in done.stderr and "Traceback" not in done.stderr


def test_a_reader_that_has_read_enough_is_no_error():
    command = [sys.executable, "-c", MAIN, "guide", "files"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()  # as `head` does
        assert process.stderr.read() == b""


def test_public_names_are_what_they_say():
    for name in bl.__all__:
        assert getattr(bl, name) is not None
    assert {"open_pours", "InputError"} <= set(bl.__all__)  # guide and messages name them
    assert callable(bl.calibrate)  # also after a module of the package was imported
    with pytest.raises(AttributeError, match="stirr"):
        getattr(bl, "stirr")  # noqa: B009  pyright would know that it is not there
    assert CliRunner().invoke(app, ["--version"]).stdout == f"bolfi-liquids {bl.__version__}\n"


# options


def commands(command=None, words=()):
    """Words of each command, and the command."""
    command = get_command(app) if command is None else command
    for name, child in command.commands.items():
        if getattr(child, "commands", None):
            yield from commands(child, (*words, name))
        else:
            yield " ".join((*words, name)), child


def test_every_command_that_simulates_says_where_and_for_how_long():
    elsewhere = {"import", "guide", "record", "trim"}  # nothing, or in real time beside an arm
    simulating = {
        words: {name for parameter in command.params for name in parameter.opts}
        for words, command in commands()
        if words not in elsewhere and not words.startswith("rig ")
    }
    assert simulating.keys() >= {"calibrate", "report", "check sbc", "simulate stir"}
    lacking = {
        words
        for words, options in simulating.items()
        if not options >= {"--workers", "--dask", "--timeout"}
    }
    assert not lacking


def test_one_worker_is_this_process():
    with ComputeOptions().opened() as compute:
        assert compute.executor is None


@checked()
class Size:
    width: Annotated[int, helped("In cm.", ge=1, lt=9)] = 3
    height: Annotated[int | None, helped("In cm.", gt=0, metavar="CM")] = None
    colour: Annotated[Literal["red", "blue"], helped("Of all.")] = "red"


def test_settings_become_options_and_arrive_whole():
    app, seen = typer.Typer(rich_markup_mode=None), []

    @app.command()
    @grouped
    def draw(
        name: Annotated[str, typer.Argument()], size: Size, loud: Annotated[bool, typer.Option()]
    ) -> None:
        seen.append((name, size, loud))

    assert CliRunner().invoke(app, ["box", "--height", "7", "--loud"]).exit_code == 0
    assert CliRunner().invoke(app, ["box", "--no-loud", "--width", "1"]).exit_code == 0
    assert CliRunner().invoke(app, ["box", "--loud", "--depth", "7"]).exit_code == 2
    shown = " ".join(CliRunner().invoke(app, ["--help"], env={"COLUMNS": "80"}).stdout.split())
    for option in (
        "--width <int> In cm. [1<=x<9]",
        "CM In cm. [0<x]",
        "<red|blue> Of all. [default",
    ):
        assert option in shown
    assert seen == [("box", Size(3, 7), True), ("box", Size(1, None), False)]
