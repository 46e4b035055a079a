"""Nothing is concluded from the stirs of an earlier model: each command says so in a line."""

import shlex
import shutil
from pathlib import Path

import pytest
import tomli_w
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.calibration.former_model import refuse_other_model
from bolfi_liquids.cli.app import app
from bolfi_liquids.errors import InputError
from bolfi_liquids.run.directory import RUN_TOML, read_run


def of_model(run, model):
    """A run of whose recordings another model simulated the stirs."""
    record = read_run(run)
    for simulator in record["simulator"].values():
        simulator["model"] = model
    (run / RUN_TOML).write_text(tomli_w.dumps(record), encoding="utf-8")
    return run


@pytest.fixture
def former(calibration, tmp_path):
    return of_model(shutil.copytree(calibration.path, tmp_path / "former"), "0")


def contents(run):
    return {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}


def refused(*words):
    """The one line that a command ends with."""
    result = CliRunner().invoke(app, [str(word) for word in words])
    lines = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
    assert result.exit_code != 0 and len(lines) == 1
    assert result.stderr.splitlines()[-1] == lines[0]
    return lines[0]


def check_command(line, run):
    """The refusal ends with a command that can be typed as it is."""
    words = shlex.split(line.partition("bolfi-liquids ")[2])
    at = words.index("--out")
    assert words[0] == "calibrate"
    assert at > 1 and all(Path(one).is_file() for one in words[1:at])
    assert not Path(words[at + 1]).exists()


@pytest.mark.parametrize(
    "command", [("criticise",), ("pour",), ("report",), ("report", "--still")], ids=" ".join
)
def test_a_command_refuses_it_and_says_how_to_go_on(former, command):
    before = contents(former)
    name, *options = command
    line = refused(name, former, *options)
    assert str(former) in line
    check_command(line, former)
    assert contents(former) == before


def test_its_pour_is_not_executed(poured_run):
    before = contents(of_model(poured_run, "0"))
    check_command(refused("pour", poured_run, "--execute"), poured_run)
    assert contents(poured_run) == before


def test_a_calibration_does_not_go_on(former, short_recording, settings):
    before = contents(former)
    options = [word for name, value in settings.items() for word in (f"--{name}", value)]
    line = refused("calibrate", short_recording, "--out", former, "--resume", *options)
    assert "model" in line and "--out" in line
    assert contents(former) == before


def test_it_can_still_be_opened(former):
    calibration = bl.Calibration.open(former)
    with pytest.raises(InputError):
        refuse_other_model(calibration)


def test_a_run_without_copies_of_its_recordings_is_told_to_give_them(former):
    shutil.rmtree(former / "recordings")
    assert "RECORDING..." in refused("criticise", former)


def test_a_run_of_today_is_not_refused(calibration):
    refuse_other_model(calibration)
