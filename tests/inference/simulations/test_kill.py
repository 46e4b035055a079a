"""kill -9 at any moment of a parallel run: it resumes, repeats nothing stored, loses nothing."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from bolfi_liquids import inference

BUDGET, BATCH = 20, 3
POOLS = "threads", "processes", "none"

# One process imports the engine, and a fork of it makes each run; JAX has not started then.
SERVER = """
import contextlib, functools, json, multiprocessing, os, sys, time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
import numpy as np

def simulate(log, theta, seeds):
    time.sleep(0.02 + 0.1 * (seeds[0] % 7) / 7)
    noise = [np.random.default_rng(seed).normal(0, 0.05, 20) for seed in seeds]
    signals = theta["a"][:, None] * np.linspace(0, 1, 20) + np.stack(noise)
    with open(log, "a") as file:
        file.write("".join(f"{seed}\\n" for seed in seeds))
    return signals

def run(log, bank, out, pool):
    from bolfi_liquids import inference
    import numpyro.distributions as dist

    os.setsid()  # so that the workers can be killed with it
    spawn = multiprocessing.get_context("spawn")
    make = {
        "threads": ThreadPoolExecutor,
        "processes": functools.partial(ProcessPoolExecutor, mp_context=spawn),
        "none": lambda workers: contextlib.nullcontext(),
    }[pool]
    prior = inference.Prior({"a": dist.Uniform(-1.0, 1.0)})
    with make(BATCH) as executor:
        fit = inference.fit(
            functools.partial(simulate, log), prior, 0.3 * np.linspace(0, 1, 20),
            budget=BUDGET, batch=BATCH, confirm=0, bank=bank, identity="line",
            executor=executor)
    draws = fit.sample("emcee", chains=2, draws=64, warmup=20)["posterior"]["a"]
    np.savez(out, best=fit.best["a"], draws=draws, tried=fit.simulations["a"],
             signals=fit.simulations["signal"], seeds=fit.simulations["seed"])

if __name__ == "__main__":
    from bolfi_liquids import inference
    [getattr(inference, name) for name in inference.__all__]
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            try:
                run(*json.loads(line))
            finally:
                os._exit(sys.exc_info()[0] is not None)
        print(child, flush=True)
        print(os.waitpid(child, 0)[1], flush=True)
"""


class Server:
    """Makes one run at a time."""

    def __init__(self, folder):
        script = folder / "server.py"
        script.write_text(SERVER.replace("BUDGET", str(BUDGET)).replace("BATCH", str(BATCH)))
        cache = {
            "JAX_COMPILATION_CACHE_DIR": str(folder / "jax"),
            "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        }
        self.process = subprocess.Popen(
            [sys.executable, str(script)],
            **{"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True},
            **{"cwd": folder, "env": os.environ | cache},
        )

    def start(self, files, pool):
        print(json.dumps([*map(str, files), pool]), file=self.process.stdin, flush=True)
        return int(self.process.stdout.readline())

    def wait(self):
        return int(self.process.stdout.readline())


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    server = Server(tmp_path_factory.mktemp("server"))
    with server.process:
        yield server
        server.process.stdin.close()


@pytest.fixture(scope="module")
def undisturbed(server, tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    files = [folder / f"whole.{suffix}" for suffix in ("log", "sqlite", "npz")]
    server.start(files, "processes")
    assert server.wait() == 0
    return np.load(files[2])


def lines(path):
    return path.read_text().split() if path.exists() else []


def stored(path):
    """Seeds in the bank, which may have been killed before it existed."""
    if not path.exists():
        return set()
    with inference.SimulationBank(path) as bank:
        return set(bank.simulations("").seeds.astype(str)) if len(bank) else set()


def kill_in_the_middle(server, files, pool, finished, delay):
    """Kill a run and its workers `delay` seconds after some simulations have finished."""
    run = server.start(files, pool)
    deadline = time.monotonic() + 60.0
    while len(lines(files[0])) < finished and time.monotonic() < deadline:
        time.sleep(0.002)
    time.sleep(delay)
    for _ in range(1000):  # at first it has no group of its own
        try:
            os.killpg(run, signal.SIGKILL)
            break
        except ProcessLookupError:
            time.sleep(0.001)
    assert server.wait() in (signal.SIGKILL, 0)  # 0 if this process was not given the time


@pytest.mark.minutes
def test_killed_at_any_moment(tmp_path, server, undisturbed):
    """At a random moment after so many of 20 simulations; with threads, processes and neither.

    What was running, at most one per worker or one batch, is simulated again; nothing else is.
    """
    chance = np.random.default_rng()
    for finished in range(BUDGET):
        pool = POOLS[finished % 3]
        delay = chance.uniform(0.0, 0.1 if finished else 1.0)
        case = f"{pool}, {finished} finished, {delay:.4f} s"
        log, bank, out = (tmp_path / f"{finished}.{suffix}" for suffix in ("log", "sqlite", "npz"))
        kill_in_the_middle(server, (log, bank, out), pool, finished, delay)
        before, kept = lines(log), stored(bank)
        assert kept <= set(before) and len(before) - len(kept) <= BATCH, case
        server.start((log, bank, out), pool)
        assert server.wait() == 0, case
        again = lines(log)[len(before) :]
        assert len(again) == len(set(again)) == BUDGET - len(kept), case
        assert not kept & set(again), case
        found = np.load(out)
        for key in undisturbed:
            np.testing.assert_array_equal(found[key], undisturbed[key], err_msg=case)
        print(f"{case}: {len(kept)} stored")
