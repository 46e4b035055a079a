"""The command line as a person meets it."""

import shutil
import sqlite3
import subprocess
import sys
from importlib.resources import files

import pytest
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.cli.app import app


def bolfi_liquids(*arguments):
    """Run the command in a process of its own."""
    code = "from bolfi_liquids.cli.app import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True
    )


def test_missing_file_is_one_line_and_debug_shows_where(tmp_path):
    command = ["calibrate", str(tmp_path / "none.nc"), "--out", str(tmp_path / "run")]
    plain = CliRunner().invoke(app, command)
    assert plain.exit_code == 2
    assert plain.stdout == ""
    assert plain.stderr == f"error: {tmp_path}/none.nc: no such file; check the path\n"
    debug = bolfi_liquids("--debug", *command)
    assert debug.returncode != 0
    assert "Traceback" in debug.stderr
    assert "open_recording" in debug.stderr


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--budget", "6"),
        ("--batch", "0"),
        ("--particles", "9"),
        ("--seed", "-1"),
        ("--sampler", "gibbs"),
        ("--surrogate", "spline"),
    ],
)
def test_bad_option_is_named_with_its_value(short_recording, tmp_path, option, value):
    out = tmp_path / "run"
    result = CliRunner().invoke(
        app, ["calibrate", str(short_recording), "--out", str(out), option, value]
    )
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith(f"error: {option}: ")
    assert value in line
    assert not out.exists()


@pytest.mark.parametrize("command", [[], ["calibrate"], ["pour"], ["report"], ["demo"]])
def test_help_is_no_error(command):
    result = CliRunner().invoke(app, [*command, "--help"])
    assert (result.exit_code, result.stderr) == (0, "")
    assert "Usage" in result.stdout


@pytest.mark.parametrize("group", [[], ["rig"], ["check"], ["simulate"]])
def test_a_group_without_a_command_shows_its_help(group):
    result = CliRunner().invoke(app, group)
    assert (result.exit_code, result.stderr) == (2, "")
    assert result.stdout == CliRunner().invoke(app, [*group, "--help"]).stdout


@pytest.mark.parametrize(
    ("arguments", "named"),
    [(["--budget", "ten"], "--budget"), (["--frobnicate"], "--frobnicate"), ([], "--out")],
)
def test_misuse_is_one_line(short_recording, arguments, named):
    result = CliRunner().invoke(app, ["calibrate", str(short_recording), *arguments])
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith("error: ") and named in line


@pytest.mark.parametrize(
    ("file", "command", "advice"),
    [
        ("posterior.nc", "report", "--resume"),
        ("posterior.nc", "pour", "--resume"),
        ("simulations.sqlite", "pour", "another --out"),
    ],
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
    connection.execute("DROP TABLE simulation")
    connection.execute("CREATE TABLE simulation (x)")
    connection.commit()
    connection.close()
    result = CliRunner().invoke(app, ["pour", str(run)])
    assert result.exit_code == 2
    *_, line = result.stderr.strip().splitlines()  # after that of the progress
    assert "simulations.sqlite" in line


def test_cups_in_millimetres_are_refused(calibration, tmp_path):
    good = (files("bolfi_liquids.data") / "cups.toml").read_text(encoding="utf-8")
    path = tmp_path / "cups.toml"
    path.write_text(good.replace("radius = 0.028", "radius = 28.0"), encoding="utf-8")
    result = CliRunner().invoke(app, ["pour", str(calibration.path), "--cups", str(path)])
    assert result.exit_code == 2
    assert "source.radius: " in result.stderr


@pytest.mark.parametrize("command", ["pour", "report"])
def test_directory_without_a_run_is_refused(tmp_path, command):
    result = CliRunner().invoke(app, [command, str(tmp_path)])
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith(f"error: {tmp_path}: no run.toml")


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("radius = 0.028", "radius = -0.028", "-0.028"),
        ("lip_height", "lip_hight", "lip_height"),
        ("[source]", "[source", "not TOML"),
    ],
)
def test_bad_cups_are_refused_in_one_line(calibration, tmp_path, old, new, named):
    good = (files("bolfi_liquids.data") / "cups.toml").read_text(encoding="utf-8")
    assert old in good
    path = tmp_path / "cups.toml"
    path.write_text(good.replace(old, new), encoding="utf-8")
    result = CliRunner().invoke(app, ["pour", str(calibration.path), "--cups", str(path)])
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith(f"error: {path}: ")
    assert named in line


def test_resuming_where_no_run_is_is_refused(short_recording, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "run.toml").touch()
    mistyped = tmp_path / "mien"
    command = ["calibrate", str(short_recording), "--out", str(mistyped), "--resume"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith(f"error: {mistyped}: holds no run to resume")
    assert str(tmp_path / "mine") in line
    assert not mistyped.exists()


@pytest.mark.parametrize(
    "command",
    [
        ["calibrate", "stir.nc", "--out", ""],
        ["calibrate", "stir.nc", "--out="],
        ["record", "--emulator", "--out", ""],
        ["record", "--emulator", "--calibrate", ""],
        ["simulate", "stir", "--out", ""],
        ["simulate", "pour", "--movie="],
        ["check", "sbc", "--out", ""],
        ["demo", "--out", ""],
        ["import", "stir.csv", "--columns", "columns.toml", "--out", ""],
        ["import", "--template", ""],
        ["rig", "template", ""],
        ["rig", "calibrate-cameras", "--print-board", ""],
        ["criticise", ""],
        ["pour", ""],
        ["report", ""],
    ],
)
def test_a_variable_that_was_not_set_is_no_path(monkeypatch, tmp_path, command):
    """As a path it would be the current directory."""
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    *before, last = command
    option = last.rstrip("=") or before[-1]
    named = option if option.startswith("--") else "argument"
    assert "is empty" in line and named in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "command",
    [
        ["calibrate", "{recording}", "--out", "run"],
        ["check", "sbc", "--out", "run"],
        ["simulate", "stir", "--out", "stir.nc"],
        ["simulate", "pour", "--out", "pour.nc"],
    ],
)
@pytest.mark.parametrize("seed", ["-1", str(2**31)])
def test_a_seed_out_of_range_is_refused_before_anything_is_written(
    monkeypatch, short_recording, tmp_path, command, seed
):
    monkeypatch.chdir(tmp_path)
    command = [part.format(recording=short_recording) for part in command]
    result = CliRunner().invoke(app, [*command, "--seed", seed])
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert "seed" in line and seed in line
    assert list(tmp_path.iterdir()) == []


def test_interruption_says_how_to_go_on(monkeypatch, tmp_path):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    recording = tmp_path / "stir me.nc"
    recording.write_bytes((files("bolfi_liquids.data") / "glycerin_v10.nc").read_bytes())
    (tmp_path / "run.toml").touch()  # as soon as it is there, a run has begun
    command = ["calibrate", str(recording), "--out", str(tmp_path)]
    monkeypatch.setattr("bolfi_liquids.calibration.calibrate.calibrate", interrupt)
    monkeypatch.setattr(sys, "argv", ["bolfi-liquids", *command])
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 130
    assert f"bolfi-liquids calibrate '{recording}' --out {tmp_path} --resume" in result.stderr


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
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.toml").touch()
    command = ["calibrate", str(short_recording), "--out", str(tmp_path / "run")]
    done = subprocess.run([sys.executable, "-c", STOPPED, *command], capture_output=True, text=True)
    assert done.returncode == 130
    assert f"--out {tmp_path / 'run'} --resume" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize("arguments", [["--help"], ["guide"], ["guide", "files"]])
def test_a_reader_that_has_read_enough_is_no_error(arguments):
    code = "from bolfi_liquids.cli.app import main; main()"
    command = [sys.executable, "-c", code, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()  # as `head` does
        assert process.stderr.read() == b""


def test_version():
    result = CliRunner().invoke(app, ["--version"])
    assert result.stdout == f"bolfi-liquids {bl.__version__}\n"


def test_import_is_cheap():
    heavy = ("jax", "taichi", "xarray", "matplotlib", "numpyro")
    code = f"import sys, bolfi_liquids; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_public_names_are_what_they_say():
    for name in bl.__all__:
        assert getattr(bl, name) is not None
    assert {"open_pours", "InputError"} <= set(bl.__all__)  # guide and messages name them
    assert callable(bl.calibrate)  # also after a module of the package was imported
    with pytest.raises(AttributeError, match="stirr"):
        getattr(bl, "stirr")  # noqa: B009  pyright would know that it is not there
