"""Commands are killed at random moments and repeated: the same bits, and nothing simulated twice.

    python tests/benchmarks/killed_runs.py [--kills 60] [--seed 0]

Each kill is of `calibrate`, `criticise` or `pour` on a small run, by SIGKILL, SIGTERM or SIGINT.
The command is then repeated (`calibrate` with --resume), and its run compared with one that nobody
disturbed: draws, chosen action, simulations, and when those were made that the killed one had.
"""

import argparse
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from importlib.resources import files
from pathlib import Path

import numpy as np
import xarray as xr

import bolfi_liquids as bl
from bolfi_liquids.run.run import SIMULATIONS, Run

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
SAMPLES = 60  # 2 s of the bundled recording
CALIBRATE = "--budget 8 --batch 2 --particles 200 --seed 5".split()
COMMANDS = {
    "calibrate": lambda run, stir: ["calibrate", str(stir), "--out", str(run), *CALIBRATE],
    "criticise": lambda run, _: ["criticise", str(run), "--effects", "camera_delay"],
    "pour": lambda run, _: ["pour", str(run), "--budget", "24", "--iterations", "7", "--force"],
}
CODE = "from bolfi_liquids.cli.app import main; main()"


def command(name, run, stir, *, again=False):
    """What is typed for a step, and typed again after it was killed."""
    more = ["--resume"] if again and name == "calibrate" and run.exists() else []
    return [sys.executable, "-W", "ignore", "-c", CODE, *COMMANDS[name](run, stir), *more]


def made(run):
    """(identity, theta, seed) -> when it was made, of every simulation of a run."""
    path = run / SIMULATIONS
    if not path.exists():
        return {}
    with closing(sqlite3.connect(path)) as bank:
        try:
            rows = bank.execute("SELECT identity, theta, seed, created FROM simulation").fetchall()
        except sqlite3.OperationalError:  # the file is there, its table not yet
            return {}
    return {row[:3]: row[3] for row in rows}


def concluded(run, name):
    """The numbers of a step's result."""
    tree = Run.open(run).required(name)
    group = "chosen" if name == "pour" else "posterior"
    return {key: values.to_numpy() for key, values in tree[group].data_vars.items()}


def run_of(stage, stir, folder):
    """An undisturbed run up to and with a stage, and how long that stage took [s]."""
    run, seconds = folder / f"whole_{stage}", 0.0
    for name in COMMANDS:
        began = time.monotonic()
        subprocess.run(command(name, run, stir), check=True, capture_output=True)
        seconds = time.monotonic() - began
        if name == stage:
            return run, seconds
        shutil.copytree(run, folder / f"before_{stage}", dirs_exist_ok=True)
    raise KeyError(stage)


def killed(name, run, stir, number, after):
    """Begin a step and kill it after so many seconds; whether it lived so long."""
    with subprocess.Popen(command(name, run, stir), stderr=subprocess.DEVNULL) as process:
        try:
            process.wait(after)
            return False
        except subprocess.TimeoutExpired:
            os.kill(process.pid, SIGNALS[number % len(SIGNALS)])
            return True


def fault_of(name, run, stir, whole):
    """What is wrong with a killed run after its step was repeated; "" where nothing is."""
    before = made(run)
    again = run.exists() and (run / "run.toml").exists()
    done = subprocess.run(
        command(name, run, stir, again=again), capture_output=True, text=True, check=False
    )
    if done.returncode:
        return f"refused: {done.stderr.strip().splitlines()[-1]}"
    after = made(run)
    if any(after.get(key) != when for key, when in before.items()):
        return "simulated twice"
    if after.keys() != made(whole).keys():
        return "other simulations"
    one, other = concluded(run, name), concluded(whole, name)
    same = one.keys() == other.keys() and all(np.array_equal(one[k], other[k]) for k in one)
    return "" if same else "other numbers"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    rng, faults, alive = np.random.default_rng(given.seed), [], 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        stir = folder / "stir.nc"
        bundled = files("bolfi_liquids.data") / "glycerin_v10.nc"
        with xr.open_dataset(bundled, decode_times=False) as recording:
            recording.isel(time=slice(0, SAMPLES)).to_netcdf(stir)
        wholes = {stage: run_of(stage, stir, folder) for stage in COMMANDS}
        for number in range(given.kills):
            stage = list(COMMANDS)[number // len(SIGNALS) % len(COMMANDS)]
            whole, seconds = wholes[stage]
            run = folder / "killed"
            shutil.rmtree(run, ignore_errors=True)
            if (before := folder / f"before_{stage}").exists():
                shutil.copytree(before, run)
            alive += killed(stage, run, stir, number, rng.uniform(0.5, seconds))
            if fault := fault_of(stage, run, stir, whole):
                faults.append(fault)
                print(f"{stage}, {SIGNALS[number % len(SIGNALS)].name}: {fault}", flush=True)
    print(f"{alive} of {given.kills} killed; faults: {len(faults)}; {bl.__version__}")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
