"""A run that version 0.1.0 made: it opens, and goes on or is refused by its version.

tests/data/run_0_1.tar.xz was written by commit 7794879, from the first 60 samples of the bundled
glycerin_v10.nc (kept within as recordings/1-short.nc):

    run = bl.calibrate("short.nc", out="run_0_1", budget=8, batch=2, particles=100, seed=3,
                       chains=2, draws=100)
    bl.choose_pour(run, iterations=7, draws=2)
    bl.criticise("run_0_1", effects=["camera_delay"])
"""

import json
import sqlite3
import tarfile
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import bolfi_liquids as bl
from bolfi_liquids.calibration.stir_simulator import stirring_of
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.prior import describe_prior
from bolfi_liquids.pouring.result import Pour
from bolfi_liquids.run.directory import RUN_TOML, SIMULATIONS, open_bank, read_run
from bolfi_liquids.run.recordings import kept_recordings

ARCHIVE = Path(__file__).parents[2] / "data" / "run_0_1.tar.xz"
SETTINGS = {
    **{"budget": 8, "batch": 2, "particles": 100, "seed": 3, "chains": 2, "draws": 100},
    "surrogate": "discrepancy",  # the default of that version
}


@pytest.fixture
def run(tmp_path):
    with tarfile.open(ARCHIVE) as archive:
        archive.extractall(tmp_path, filter="data")
    return tmp_path / "run_0_1"


def resumed(run: Path) -> "bl.Calibration | str":
    """The calibration, or why it was refused."""
    try:
        recording = run / "recordings" / "1-short.nc"
        return bl.calibrate(recording, out=run, resume=True, progress=False, **SETTINGS)
    except InputError as err:
        return str(err)


def test_its_calibration_opens(run):
    calibration = bl.Calibration.open(run)
    assert describe_prior(calibration.prior)["viscosity"]["low"] == 0.003
    summary = json.loads((run / "summary.json").read_text())["calibrate"]
    for name, spread in summary["parameters"].items():
        assert float(calibration.posterior[name].mean()) == pytest.approx(spread["mean"])
    assert calibration.best == summary["best"]
    assert set(calibration.draws(16)) == {"viscosity", "cohesion"}


def test_its_criticism_and_its_pour_open(run):
    summary = json.loads((run / "summary.json").read_text())
    criticism = bl.Criticism.open(run)
    assert criticism.verdict == summary["criticise"]["verdict"]
    chosen = Pour.open(run).chosen
    speed = summary["pour"]["angular_velocity_deg_s"]
    assert np.degrees(chosen.angular_velocity) == pytest.approx(speed)


def test_its_simulations_are_those_of_the_same_simulator(run):
    """Else they would be made again, and the bank would hold both."""
    (recording,) = kept_recordings(run, read_run(run))
    now = stirring_of([recording], SETTINGS["particles"]).identity
    with closing(sqlite3.connect(run / SIMULATIONS)) as bank:
        held = {
            identity for (identity,) in bank.execute("SELECT DISTINCT identity FROM simulation")
        }
    same_model = read_run(run)["simulator"] == read_run_of_today(recording)
    assert (now in held) is same_model
    with open_bank(run) as bank:
        assert len(bank) > SETTINGS["budget"]


def read_run_of_today(recording: bl.Recording) -> dict:
    """The simulator's section of a run.toml that would be written now."""
    return json.loads(json.dumps(stirring_of([recording], SETTINGS["particles"]).settings))


def test_it_goes_on_or_is_refused_by_its_version(run):
    before = {path: path.read_bytes() for path in run.glob("*.*")}
    outcome = resumed(run)
    if isinstance(outcome, str):
        assert "model" in outcome and "\n" not in outcome
    else:
        assert outcome.best == bl.Calibration.open(run).best
    assert all(path.read_bytes() == held for path, held in before.items())


@pytest.mark.parametrize(("section", "field"), [("engine", "version"), ("simulator", "model")])
def test_another_engine_or_model_is_refused_by_the_version_that_made_the_run(run, section, field):
    record = read_run(run)
    record["versions"]["bolfi-liquids"] = "0.0.9"
    table = record[section] if section == "engine" else record[section]["recording_1"]
    table[field] = "0"
    (run / RUN_TOML).write_text(tomli_w.dumps(record))
    assert "0.0.9" in resumed(run)
    record["versions"]["bolfi-liquids"] = bl.__version__
    (run / RUN_TOML).write_text(tomli_w.dumps(record))
    assert bl.__version__ not in resumed(run)  # this very version cannot go on, either
    bl.Calibration.open(run)
