"""Commands are stopped at random moments and repeated: the same bits, and nothing simulated twice.

    python tests/benchmarks/killed_runs.py [--kills 60] [--disks 10] [--seed 0]

A kill is of `calibrate`, `criticise`, `pour` or `check sbc` on a small run, or of
`record --emulator`, by SIGKILL, SIGTERM or SIGINT; a full disk is a limit on the size of files
(EFBIG), which needs no right to mount one. The command is then repeated (`calibrate` with
--resume), and what it has concluded compared with a run that nobody disturbed: numbers,
simulations, and when those were made that the stopped one had. A recording cannot be repeated:
its processes must end, and another one must succeed.
"""

import argparse
import json
import os
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from importlib.resources import files
from pathlib import Path

import numpy as np
import xarray as xr

import bolfi_liquids as bl
from bolfi_liquids.run.results import read_result
from bolfi_liquids.run.run import SIMULATIONS, Run

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
SAMPLES = 60  # 2 s of the bundled recording
ENDED = 10.0  # s, until every process of a recording that was killed must be gone
SMALL_DISK = 2_000, 2_000_000  # bytes that a file may have, at least and at most
GROUPS = {"calibrate": "posterior", "criticise": "posterior", "pour": "chosen"}
STUDY = "--runs 6 --sequential 2 --design 8 --budget 10 --particles 200".split()
WORDS = {
    "calibrate": "--budget 8 --batch 2 --particles 200 --seed 5".split(),
    "criticise": "--effects camera_delay".split(),
    "pour": "--budget 24 --iterations 7 --force".split(),
}
RUN_STAGES = tuple(WORDS)
STAGES = (*RUN_STAGES, "check sbc", "record")
CODE = "from bolfi_liquids.cli.app import main; main()"


def command(stage, run, stir, *, again=False):
    """What is typed for a stage, and typed again after it was stopped."""
    match stage:
        case "calibrate":
            resume = ["--resume"] if again and (run / "run.toml").exists() else []
            words = ["calibrate", stir, "--out", run, *WORDS[stage], *resume]
        case "check sbc":
            words = ["check", "sbc", "--recording", stir, "--out", run, "--workers", "1", *STUDY]
        case "record":
            words = ["record", "--emulator", "--cycles", "1", "--out", run]
        case _:
            words = [stage, run, *WORDS[stage]]
    return [sys.executable, "-W", "ignore", "-c", CODE, *map(str, words)]


def made(run):
    """(identity, theta, seed) -> when it was made, of every simulation of a run."""
    found = {}
    if (path := run / SIMULATIONS).exists():
        with closing(sqlite3.connect(path)) as bank, suppress(sqlite3.OperationalError):
            # there may be a file without its table yet
            for row in bank.execute("SELECT identity, theta, seed, created FROM simulation"):
                found[row[:3]] = row[3]
    return found


def concluded(stage, run):
    """The numbers of a stage's result, by name."""
    if stage == "check sbc":
        tree = read_result(run / "sbc.nc")
        groups = {name: tree[f"{name}/replicates"] for name in tree.children}
    else:
        groups = {stage: Run.open(run).required(stage)[GROUPS[stage]]}
    return {
        (group, key): values.to_numpy()
        for group, there in groups.items()
        for key, values in there.data_vars.items()
        if key != "seconds"
    }


def whole_run(stage, stir, folder):
    """An undisturbed run up to and with a stage, and how long that stage took [s]."""
    run, seconds = folder / f"whole {stage}", 0.0
    before = RUN_STAGES[: RUN_STAGES.index(stage)] if stage in RUN_STAGES else ()
    for name in (*before, stage):
        if name == stage and run.exists():
            shutil.copytree(run, folder / f"before {stage}")
        began = time.monotonic()
        done = subprocess.run(command(name, run, stir), capture_output=True, check=False)
        seconds = time.monotonic() - began
        assert done.returncode in ((0, 1) if stage == "check sbc" else (0,)), done.stderr
    return run, seconds


def killed(words, number, after):
    """Begin and kill after so many seconds; whether it lived so long, and its process group."""
    with subprocess.Popen(
        words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    ) as process:
        try:
            process.wait(after)
            return False, process.pid
        except subprocess.TimeoutExpired:
            os.kill(process.pid, SIGNALS[number % len(SIGNALS)])
            return True, process.pid


def on_a_small_disk(words, size):
    """Begin where no file grows beyond so many bytes; whether that stopped it."""

    def limited():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

    done = subprocess.run(words, capture_output=True, text=True, check=False, preexec_fn=limited)
    if "Traceback" in done.stderr:
        print(done.stderr, flush=True)
        return None
    return done.returncode != 0


def fault_of(stage, run, stir, whole):
    """What is wrong with a stopped run after its stage was repeated; "" where nothing is."""
    before = made(run)
    words = command(stage, run, stir, again=True)
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode and stage != "check sbc":
        return f"refused: {done.stderr.strip().splitlines()[-1]}"
    after = made(run)
    if any(after.get(key) != when for key, when in before.items()):
        return "simulated twice"
    if after.keys() != made(whole).keys():
        return "other simulations"
    one, other = concluded(stage, run), concluded(stage, whole)
    same = one.keys() == other.keys() and all(
        np.array_equal(one[k], other[k], equal_nan=one[k].dtype.kind == "f") for k in one
    )
    return "" if same else "other numbers"


def fault_of_recording(run, group):
    """What a recording that was killed leaves; "" where nothing is wrong."""
    until = time.monotonic() + ENDED
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            break
        time.sleep(0.1)
    else:
        return "a process goes on"
    again = run.with_name("another recording")
    shutil.rmtree(again, ignore_errors=True)
    done = subprocess.run(command("record", again, None), capture_output=True, check=False)
    return f"then: {done.stderr.strip().splitlines()[-1]}" if done.returncode else ""


def faults(given, folder) -> Iterator[tuple[str, str]]:
    """Each thing that is wrong: what was stopped, and how it ended."""
    rng, alive, full = np.random.default_rng(given.seed), 0, 0
    stir = folder / "stir.nc"
    bundled = files("bolfi_liquids.data") / "glycerin_v10.nc"
    with xr.open_dataset(bundled, decode_times=False) as recording:
        recording.isel(time=slice(0, SAMPLES)).to_netcdf(stir)
    wholes = {stage: whole_run(stage, stir, folder) for stage in given.stages}
    print(json.dumps({stage: round(wholes[stage][1], 1) for stage in wholes}), flush=True)

    def fresh(stage):
        shutil.rmtree(run := folder / "stopped", ignore_errors=True)
        if (before := folder / f"before {stage}").exists():
            shutil.copytree(before, run)
        return run

    for number in range(given.kills):
        stage = given.stages[number // len(SIGNALS) % len(given.stages)]
        whole, seconds = wholes[stage]
        run = fresh(stage)
        lived, group = killed(command(stage, run, stir), number, rng.uniform(0.5, seconds))
        alive += lived
        if stage == "record":
            fault = fault_of_recording(run, group)
        else:
            fault = fault_of(stage, run, stir, whole)
        if fault:
            yield f"{stage}, {SIGNALS[number % len(SIGNALS)].name}", fault
    on_disk = [stage for stage in given.stages if stage != "record"]
    for number in range(given.disks if on_disk else 0):
        stage = on_disk[number % len(on_disk)]
        run, size = fresh(stage), int(np.exp(rng.uniform(*np.log(SMALL_DISK))))
        stopped = on_a_small_disk(command(stage, run, stir), size)
        full += bool(stopped)
        fault = "traceback" if stopped is None else fault_of(stage, run, stir, wholes[stage][0])
        if fault:
            yield f"{stage}, files of {size} bytes", fault
    print(f"{alive} of {given.kills} killed in time, {full} of {given.disks} stopped by the disk")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--disks", type=int, default=10)
    parser.add_argument("--stages", nargs="+", choices=STAGES, default=STAGES)
    parser.add_argument("--seed", type=int, default=0)
    with tempfile.TemporaryDirectory() as name:
        count = 0
        for what, fault in faults(parser.parse_args(), Path(name)):
            print(f"{what}: {fault}", flush=True)
            count += 1
    print(f"faults: {count}; {bl.__version__}")
    return bool(count)


if __name__ == "__main__":
    sys.exit(main())
