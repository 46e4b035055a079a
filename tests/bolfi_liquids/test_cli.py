"""The command line as a person meets it."""

import subprocess
import sys

import pytest
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.cli import app


def bolfi_liquids(*arguments):
    """Run the command in a process of its own."""
    code = "from bolfi_liquids.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True
    )


def test_missing_file_is_one_line_and_debug_shows_where(tmp_path):
    command = ("calibrate", tmp_path / "none.nc", "--out", tmp_path / "run")
    plain = bolfi_liquids(*command)
    assert plain.returncode == 2
    assert plain.stdout == ""
    assert plain.stderr == f"error: {tmp_path}/none.nc: no such file; check the path\n"
    debug = bolfi_liquids("--debug", *command)
    assert debug.returncode != 0
    assert "Traceback" in debug.stderr
    assert "open_recording" in debug.stderr


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--budget", "2"),
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
        ("[source]", "[source", "not a TOML file"),
    ],
)
def test_bad_cups_are_refused_in_one_line(calibration, tmp_path, old, new, named):
    from bolfi_liquids.cups import BUNDLED, files

    good = (files("bolfi_liquids.data") / BUNDLED).read_text(encoding="utf-8")
    assert old in good
    path = tmp_path / "cups.toml"
    path.write_text(good.replace(old, new), encoding="utf-8")
    result = CliRunner().invoke(app, ["pour", str(calibration.path), "--cups", str(path)])
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith(f"error: {path}: ")
    assert named in line


def test_interruption_says_how_to_go_on(monkeypatch, tmp_path):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    command = ["calibrate", "stir me.nc", "--out", str(tmp_path)]
    monkeypatch.setattr("bolfi_liquids.calibrator.calibrate", interrupt)
    monkeypatch.setattr(sys, "argv", ["bolfi-liquids", *command])
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 130
    assert f"bolfi-liquids calibrate 'stir me.nc' --out {tmp_path} --resume" in result.stderr


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
    assert callable(bl.calibrate)  # also after a module of the package was imported
    with pytest.raises(AttributeError, match="stirr"):
        getattr(bl, "stirr")  # noqa: B009  pyright would know that it is not there
