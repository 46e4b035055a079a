"""Dying in the middle of a loop, and going on."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from bolfi_liquids import inference

SCRIPT = """
import os, sys, time
import numpy as np
import numpyro.distributions as dist
from bolfi_liquids import inference
from bolfi_liquids.inference.simulations.job import simulation_seed

log, bank, out, pause = sys.argv[1:]

def simulate(theta, seeds):
    with open(log, "a") as file:
        file.writelines(f"{seed}\\n" for seed in seeds)
    time.sleep(float(pause))
    noise = [np.random.default_rng(seed).normal(0, 0.05, 20) for seed in seeds]
    return theta["a"][:, None] * np.linspace(0, 1, 20) + np.stack(noise)

prior = inference.Prior({"a": dist.Uniform(-1.0, 1.0)})
fit = inference.fit(simulate, prior, 0.3 * np.linspace(0, 1, 20), budget=10, bank=bank)
tree = fit.sample("emcee", chains=2, draws=64, warmup=20)
np.savez(out, best=fit.best["a"], draws=tree["posterior"]["a"], tried=fit.simulations["a"])
"""


def start(folder, name, pause):
    paths = [str(folder / f"{name}.{suffix}") for suffix in ("log", "sqlite", "npz")]
    cache = {
        "JAX_COMPILATION_CACHE_DIR": str(folder / "jax"),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    }
    command = [sys.executable, "-c", SCRIPT, *paths, pause]
    return subprocess.Popen(command, cwd=folder, env=os.environ | cache)


def lines(path):
    return path.read_text().split() if path.exists() else []


@pytest.mark.minutes
def test_killed_and_repeated_equals_undisturbed(tmp_path):
    """SIGKILL in the sixth simulation or later; only what was running is simulated again."""
    undisturbed = start(tmp_path, "whole", "0")
    victim = start(tmp_path, "killed", "0.5")
    deadline = time.monotonic() + 60.0
    while len(lines(tmp_path / "killed.log")) < 6 and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(victim.pid, signal.SIGKILL)
    assert victim.wait() == -signal.SIGKILL
    finished_before = len(lines(tmp_path / "killed.log"))
    with inference.SimulationBank(tmp_path / "killed.sqlite") as bank:
        assert 0 < len(bank) < finished_before < 10
        stored = len(bank)
    runs = [start(tmp_path, "killed", "0"), undisturbed]
    assert [run.wait() for run in runs] == [0, 0]
    assert len(lines(tmp_path / "killed.log")) == finished_before + 10 - stored
    killed, whole = (np.load(tmp_path / f"{name}.npz") for name in ("killed", "whole"))
    for key in ("best", "draws", "tried"):
        np.testing.assert_array_equal(killed[key], whole[key])
