"""The error that a person's input causes."""

import pickle
from importlib.resources import files

import pytest
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.cli.app import app
from bolfi_liquids.cli.errors import _how_to_go_on
from bolfi_liquids.errors import Argument, InputError


def test_it_says_the_same_in_another_process():
    error = InputError("viscosity -1 is negative", where="stir.nc", fix="give one in Pa s")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "stir.nc: viscosity -1 is negative; give one in Pa s"
    assert (again.what, again.where, again.fix) == (error.what, error.where, error.fix)


@pytest.mark.parametrize("out", [["--out", "run"], ["--out=run"], ["--out", "x", "--out", "run"]])
def test_who_interrupts_is_told_to_resume_only_what_has_begun(tmp_path, monkeypatch, out):
    monkeypatch.chdir(tmp_path)
    typed = ["calibrate", "my stir.nc", *out]
    told = _how_to_go_on(typed)
    assert "--resume" not in told and "'my stir.nc'" in told
    (tmp_path / "run").mkdir()
    assert "--resume" not in _how_to_go_on(typed)
    (tmp_path / "run" / "run.toml").touch()
    assert _how_to_go_on(typed).endswith(" --resume")
    assert _how_to_go_on([*typed, "--resume"]).count("--resume") == 1
    assert "--resume" not in _how_to_go_on(["pour", "run"])


@pytest.mark.parametrize("out", [[], ["--out"], ["--out", "--budget"], ["--out", 300 * "n"]])
def test_who_interrupts_without_a_place_is_told_to_begin_again(tmp_path, monkeypatch, out):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.toml").touch()  # of no run that was named
    assert "begin again" in _how_to_go_on(["calibrate", "stir.nc", *out])


@pytest.mark.parametrize(
    ("option", "value", "needed"),
    [("--viscosity", "1", "--emulator"), ("--viscosity", "0", "--emulator")]
    + [("--target", "0.05", "--calibrate"), ("--cups", "cups.toml", "--calibrate")],
)
def test_an_option_without_what_it_needs_is_refused_whatever_its_value(
    option, value, needed, tmp_path
):
    result = CliRunner().invoke(app, ["record", "--out", str(tmp_path / "stir"), option, value])
    assert result.exit_code == 2 and f"{option} needs {needed}" in result.stderr


TYPED = {
    "calibrate": (["stir.nc", "--out", "r", "--budget", "1"], "--budget: 1;"),
    "simulate pour": (["--angular-velocity", "0"], "--angular-velocity: 0 deg/s;"),
    "check sbc": (["--noise-deg", "-1", "--out", "r"], "--noise-deg: -1.0;"),
    "pour": (["r", "--iterations", "1"], "--iterations: 1;"),
    "record": (["--cycles", "0", "--out", "r"], "--cycles: 0;"),
}


@pytest.mark.parametrize("command", TYPED)
def test_the_command_line_names_the_option_that_was_typed(stir, command):
    typed, told = TYPED[command]
    result = CliRunner().invoke(app, [*command.split(), *typed])
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith(f"error: {told}")


@pytest.fixture
def stir(tmp_path, monkeypatch):
    """A directory with a recording stir.nc."""
    monkeypatch.chdir(tmp_path)
    content = (files("bolfi_liquids.data") / "glycerin_v10.nc").read_bytes()
    (tmp_path / "stir.nc").write_bytes(content)


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("budget", lambda: bl.calibrate("stir.nc", out="r", budget=1)),
        ("timeout", lambda: bl.calibrate("stir.nc", out="r", timeout=0.0)),
        ("iterations", lambda: bl.choose_pour("r", iterations=1)),
        ("seed", lambda: bl.criticise("r", seed=-1)),
        ("angular_velocity", lambda: bl.simulate_pour(angular_velocity=0.0)),
        ("viscosity", lambda: bl.simulate_stir(1j)),
        ("viscosity", lambda: bl.simulate_stir("1")),
        ("viscosity", lambda: bl.simulate_stir([[1.0, 2.0], [3.0]])),
        ("cohesion", lambda: bl.simulate_pour(1.0, None)),
        ("seed", lambda: bl.simulate_stir(seed=[[1, 2], [3]])),
        ("seed", lambda: bl.simulate_stir(seed=None)),
        ("seed", lambda: bl.simulate_stir(seed=2**70)),
        ("effects", lambda: bl.simulate_stir(effects="")),
        ("effects", lambda: bl.simulate_stir(effects="stick_mass=0.3")),
        ("effects", lambda: bl.simulate_pour(effects=["adhesion"])),
        ("rig", lambda: bl.simulate_stir(rig=0.04)),
        ("path", lambda: bl.simulate_stir(path=3)),
        ("path", lambda: bl.simulate_stir(path="spiral")),
        ("movie", lambda: bl.simulate_stir(movie=3)),
        ("out", lambda: bl.calibrate("stir.nc", out=3)),
        ("run", lambda: bl.choose_pour(3)),
        ("run", lambda: bl.report(None)),
        ("run", lambda: bl.Calibration.open(3)),
        ("effects", lambda: bl.criticise("r", effects=3)),
        ("effects", lambda: bl.criticise("r", effects=[3])),
        ("accept", lambda: bl.criticise("r", accept=3)),
    ],
)
def test_python_is_told_the_argument_that_was_given(stir, name, call):
    with pytest.raises(InputError) as refused:
        call()
    assert refused.value.where == name and str(refused.value).startswith(f"{name}: ")


def test_only_arguments_become_options():
    """A directory or a file may have the name of an option."""
    options = {"out": "--out", "held_out": "--held-out", "start": "--start"}
    error = InputError("holds a run", where="out", fix="give `start` or `other`")
    assert error.as_typed(options) == "out: holds a run; give --start or `other`"
    error = InputError("is\nodd", where=Argument("held_out a b.nc"), fix="give another")
    again = pickle.loads(pickle.dumps(error))
    assert again.as_typed(options) == "--held-out a b.nc: is odd; give another"
    assert str(again) == str(error)
