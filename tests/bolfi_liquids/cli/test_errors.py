"""The error that a person's input causes, and what commands tell on stderr."""

import logging
import pickle
import shlex
from pathlib import Path

import pytest

import bolfi_liquids as bl
from bolfi_liquids.cli.errors import PACKAGE, how_to_go_on, print_notices, say
from bolfi_liquids.cli.record import next_commands
from bolfi_liquids.errors import Argument, InputError
from bolfi_liquids.inputs.bundled import bundled_recording


def test_it_says_the_same_in_another_process():
    error = InputError("viscosity -1 is negative", where="stir.nc", fix="give one in Pa s")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "stir.nc: viscosity -1 is negative; give one in Pa s"
    assert (again.what, again.where, again.fix) == (error.what, error.where, error.fix)


def test_only_arguments_become_options():
    """A directory or a file may have the name of an option."""
    options = {"out": "--out", "held_out": "--held-out", "start": "--start"}
    error = InputError("holds a run", where="out", fix="give `start` or `other`")
    assert error.as_typed(options) == "out: holds a run; give --start or `other`"
    error = InputError("is\nodd", where=Argument("held_out a b.nc"), fix="give another")
    again = pickle.loads(pickle.dumps(error))
    assert again.as_typed(options) == "--held-out a b.nc: is odd; give another"
    assert str(again) == str(error)


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("budget", lambda: bl.calibrate(bundled(), out="r", budget=1)),
        ("timeout", lambda: bl.calibrate(bundled(), out="r", timeout=0.0)),
        ("out", lambda: bl.calibrate(bundled(), out=3)),
        ("iterations", lambda: bl.choose_pour("r", iterations=1)),
        ("run", lambda: bl.choose_pour(3)),
        ("run", lambda: bl.report(None)),
        ("accept", lambda: bl.criticise("r", accept=3)),
        ("effects", lambda: bl.criticise("r", effects=[3])),
        ("angular_velocity", lambda: bl.simulate_pour(angular_velocity=0.0)),
        ("cohesion", lambda: bl.simulate_pour(1.0, None)),
        ("viscosity", lambda: bl.simulate_stir(1j)),
        ("viscosity", lambda: bl.simulate_stir([[1.0, 2.0], [3.0]])),
        ("seed", lambda: bl.simulate_stir(seed=[[1, 2], [3]])),
        ("effects", lambda: bl.simulate_stir(effects="stick_mass=0.3")),
        ("rig", lambda: bl.simulate_stir(rig=0.04)),
        ("path", lambda: bl.simulate_stir(path="spiral")),
        ("movie", lambda: bl.simulate_stir(movie=3)),
    ],
)
def test_python_is_told_the_argument_that_was_given(name, call):
    with pytest.raises(InputError) as refused:
        call()
    assert refused.value.where == name and str(refused.value).startswith(f"{name}: ")


def bundled():
    """The path of a recording."""
    return bundled_recording("glycerin").path


@pytest.mark.parametrize("out", [["--out", "run"], ["--out=run"], ["--out", "x", "--out", "run"]])
def test_who_interrupts_is_told_to_resume_only_what_has_begun(tmp_path, monkeypatch, out):
    monkeypatch.chdir(tmp_path)
    typed = ["calibrate", "my stir.nc", *out]
    told = how_to_go_on(typed)
    assert "begin again" in told and "--resume" not in told and "'my stir.nc'" in told
    (tmp_path / "run").mkdir()
    assert "--resume" not in how_to_go_on(typed)
    (tmp_path / "run" / "run.toml").touch()
    assert how_to_go_on(typed).endswith(" --resume")
    assert how_to_go_on([*typed, "--resume"]).count("--resume") == 1
    assert "--resume" not in how_to_go_on(["pour", "run"])


@pytest.mark.parametrize("path", ["my  stir.nc", "it's.nc", '"a" $b;c.nc'])
def test_a_printed_command_is_read_by_a_shell_as_it_was_meant(capsys, path):
    wanted = ["bolfi-liquids", "calibrate", path, "--out", "RUN"]
    (printed,) = next_commands(Path(path), None)
    assert shlex.split(printed) == wanted
    say(how_to_go_on(wanted[1:]))
    assert shlex.split(capsys.readouterr().err.partition("with: ")[2]) == wanted
    error = InputError("odd", where="run", fix=f"go on with: {printed}")
    assert shlex.split(error.as_typed({}).partition("with: ")[2]) == wanted
    assert [shlex.split(one)[2:] for one in next_commands(Path(), Path(path))] == [[path]] * 2


def test_who_interrupts_without_a_place_is_told_to_begin_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.toml").touch()  # of no run that was named
    for out in ([], ["--out"], ["--out", "--budget"], ["--out", 300 * "n"]):
        assert "begin again" in how_to_go_on(["calibrate", "stir.nc", *out])


def test_notices_are_printed_once_however_often_it_is_asked(capsys):
    print_notices()
    print_notices()
    logging.getLogger(f"{PACKAGE}.calibration").warning("%s: removed", "runs/mine")
    logging.getLogger(f"{PACKAGE}.calibration").debug("not for everybody")
    assert capsys.readouterr().err == "runs/mine: removed\n"
