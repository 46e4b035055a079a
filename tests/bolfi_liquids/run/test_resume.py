"""A run that is killed and resumed is the run that was not."""

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

import bolfi_liquids as bl
from bolfi_liquids.run.run import SIMULATIONS

# On two cores, 24 processes beside it, a criticism began to simulate after 127 s; with a patience
# of 120 s it was killed before, and the test failed.
PATIENCE_S = 1800
EFFECTS = ("camera_delay", "gripper_scale", "stick_mass")
STIRRINGS = "SELECT theta, seed, created FROM simulation WHERE theta LIKE '%viscosity%'"


def command(recording, out, settings, *more):
    options = [part for name, value in settings.items() for part in (f"--{name}", str(value))]
    code = "from bolfi_liquids.cli.app import main; main()"
    return [sys.executable, "-c", code, "calibrate", recording, "--out", out, *options, *more]


def criticise_command(run):
    options = [part for name in EFFECTS for part in ("--effects", name)]
    code = "from bolfi_liquids.cli.app import main; main()"
    return [sys.executable, "-c", code, "criticise", str(run), *options]


def finished(run):
    """(theta, seed) -> time of creation of every stirring in a run's bank."""
    path = run / SIMULATIONS
    if not path.exists():
        return {}
    connection = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    try:
        rows = connection.execute(STIRRINGS).fetchall()
    except sqlite3.OperationalError:  # the file is there, its table not yet
        return {}
    finally:
        connection.close()
    return {(theta, seed): created for theta, seed, created in rows}


def kill_after(process, run, count):
    """Kill a process once so many stirrings are in its bank; what the bank holds then.

    However slow the computer, only a process that ended by itself, or hangs, is waited for in vain.
    """
    deadline = time.monotonic() + PATIENCE_S
    while len(finished(run)) < count:
        assert process.poll() is None, f"ended with status {process.returncode} before its kill"
        assert time.monotonic() < deadline, f"{len(finished(run))} stirrings in {PATIENCE_S} s"
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    return finished(run)


@pytest.mark.slow
def test_killed_and_resumed_equals_undisturbed(short_recording, calibration, settings, tmp_path):
    run = tmp_path / "killed"
    process = subprocess.Popen(command(short_recording, run, settings), stderr=subprocess.DEVNULL)
    before = kill_after(process, run, 2)
    whole = finished(calibration.path)
    assert 2 <= len(before) < len(whole)

    subprocess.run(
        command(short_recording, run, settings, "--resume"), check=True, capture_output=True
    )
    after = finished(run)
    assert {key: after[key] for key in before} == before  # none was simulated again
    assert after.keys() == whole.keys()
    resumed = bl.Calibration.open(run)
    for name, draws in calibration.posterior.items():
        np.testing.assert_array_equal(resumed.posterior[name], draws)
    assert resumed.summary.n_simulations == settings["budget"]


def test_finished_run_is_opened_not_repeated(short_recording, calibration, settings):
    before = finished(calibration.path)
    posterior = calibration.path / "posterior.nc"
    written = posterior.stat().st_mtime_ns
    again = bl.calibrate(
        short_recording, out=calibration.path, resume=True, progress=False, **settings
    )
    assert finished(calibration.path) == before
    assert posterior.stat().st_mtime_ns == written
    assert again.summary == calibration.summary


@pytest.mark.slow
def test_a_larger_budget_goes_on_from_a_smaller_one(
    short_recording, calibration, settings, tmp_path
):
    grown, larger = tmp_path / "grown", settings | {"budget": 14}
    shutil.copytree(calibration.path, grown)
    before = finished(grown)
    again = bl.calibrate(short_recording, out=grown, resume=True, progress=False, **larger)
    after = finished(grown)
    assert {key: after[key] for key in before} == before  # none was simulated again
    whole = bl.calibrate(short_recording, out=tmp_path / "whole", progress=False, **larger)
    assert after.keys() >= finished(whole.path).keys()
    for name, draws in whole.posterior.items():
        np.testing.assert_array_equal(again.posterior[name], draws)
    with pytest.raises(ValueError, match="budget is 14 in the run, but 8 was asked"):
        bl.calibrate(short_recording, out=grown, resume=True, progress=False, **settings)


@pytest.mark.minutes
def test_criticism_killed_and_repeated_equals_undisturbed(calibration, tmp_path):
    quiet, killed = tmp_path / "quiet", tmp_path / "killed"
    shutil.copytree(calibration.path, quiet)
    shutil.copytree(calibration.path, killed)
    known = finished(killed)
    whole = bl.criticise(quiet, effects=EFFECTS, progress=False)

    process = subprocess.Popen(criticise_command(killed), stderr=subprocess.DEVNULL)
    before = kill_after(process, killed, len(known) + 4)
    assert len(known) < len(before) < len(finished(quiet))
    assert "criticise" not in (killed / "summary.json").read_text()

    subprocess.run(criticise_command(killed), check=True, capture_output=True)
    after = finished(killed)
    assert {key: after[key] for key in before} == before  # none was simulated again
    assert after.keys() == finished(quiet).keys()
    again = bl.Criticism.open(killed)
    for name, draws in whole.tree["posterior"].items():
        np.testing.assert_array_equal(again.tree["posterior"][name], draws)
    assert replace(whole.summary, seconds=again.summary.seconds) == again.summary

    written = (killed / "criticism.nc").stat().st_mtime_ns
    bl.criticise(killed, effects=EFFECTS, progress=False)  # what is there is opened
    assert (killed / "criticism.nc").stat().st_mtime_ns == written
