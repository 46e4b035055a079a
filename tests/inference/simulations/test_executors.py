"""Where simulations run changes neither what is asked nor what is concluded."""

import importlib
import multiprocessing
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor

import dask
import numpy as np
import pytest
from bolfi_liquids.inference.simulations.job import BATCH, simulation_seed
from distributed import LocalCluster

from bolfi_liquids import inference

BUDGET, INITIAL = 9, 5

WORKER_SIDE = """
import os, sys
import numpy as np

TIME = np.linspace(0.0, 1.0, 30)

def simulate(theta, seeds):
    loaded = [name for name in ("jax", "numpyro", "scipy", "bolfi_liquids.calibration.calibrate")
              if name in sys.modules]
    if loaded:
        raise RuntimeError(f"the worker had to load {loaded}")
    noise = np.stack([np.random.default_rng(seed).normal(0.0, 0.05, TIME.size) for seed in seeds])
    return theta["slope"][:, None] * TIME + theta["offset"][:, None] + noise

class Deadly:
    def __init__(self, path, seed):
        self.path, self.seed = path, seed

    def __call__(self, theta, seeds):
        if self.seed in seeds and not os.path.exists(self.path):
            os._exit(1)
        return simulate(theta, seeds)
"""


@pytest.fixture
def worker_side(tmp_path, monkeypatch):
    """A module that spawned workers find, for they are given this process's path."""
    (tmp_path / "worker_side.py").write_text(WORKER_SIDE)
    monkeypatch.syspath_prepend(tmp_path)
    yield importlib.import_module("worker_side")
    sys.modules.pop("worker_side")


def spawned(workers):
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))


def dithering(simulate):
    """The simulator, whose runs end in an order that no two tries repeat."""
    chance = np.random.default_rng()  # unseeded on purpose

    def dither(theta, seeds):
        time.sleep(chance.uniform(0.0, 0.05))
        return simulate(theta, seeds)

    return dither


@pytest.fixture(scope="module")
def by_hand(prior, observed, simulate):
    """Ask and tell by the documented rule: point i once all up to i - 3 have been told."""
    engine = inference.Bolfi(prior, observed, initial=INITIAL)
    asked = [engine.ask(1) for _ in range(3)]
    for told in range(BUDGET):
        seeds = [simulation_seed(0, told)]
        engine.tell(asked[told], simulate(asked[told], seeds), seeds)
        if len(asked) < BUDGET:
            asked.append(engine.ask(1))
    return engine.fit()


def assert_same(fit, other):
    for name in ("theta", "signals", "seeds", "rounds"):
        np.testing.assert_array_equal(getattr(fit.history, name), getattr(other.history, name))
    assert fit.best == other.best


@pytest.mark.slow
def test_threads_that_finish_out_of_order(prior, observed, simulate, by_hand):
    with ThreadPoolExecutor(3) as pool:
        for executor in (pool, pool, None):
            fit = inference.fit(dithering(simulate), prior, observed, **options(executor))
            assert_same(fit, by_hand)


@pytest.mark.slow
def test_spawned_processes_that_load_no_jax(prior, observed, by_hand, worker_side):
    with spawned(2) as pool:
        fit = inference.fit(worker_side.simulate, prior, observed, **options(pool))
    assert fit.failures == {}
    assert_same(fit, by_hand)


@pytest.mark.slow
def test_dask_by_its_client_and_by_its_address(prior, observed, simulate, by_hand):
    local = {"processes": False, "n_workers": 1, "threads_per_worker": 2, "protocol": "tcp://"}
    with LocalCluster(**local, dashboard_address=":0") as cluster:
        with cluster.get_client() as client:
            given = inference.fit(simulate, prior, observed, **options(client))
        address = cluster.scheduler_address
        found = inference.fit(simulate, prior, observed, **options(address))
        deadline = time.monotonic() + 10.0
        while clients(cluster) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert clients(cluster) == []  # it was closed
    assert_same(given, by_hand)
    assert_same(found, by_hand)


def clients(cluster):
    return [name for name in cluster.scheduler.clients if name.startswith("Client")]


def options(executor):
    """Three in flight."""
    flying = {"batch": 3, "in_rounds": False}
    return {"budget": BUDGET, "confirm": 0, "initial": INITIAL, "executor": executor, **flying}


def test_keeps_batch_in_flight_and_no_more(prior, observed, simulate):
    """Runs 0 to 2 wait for one another, so all three must run at once; a fourth never does."""
    together, lock, flying, most = threading.Barrier(3), threading.Lock(), [0], [0]
    first = [simulation_seed(0, index) for index in range(3)]

    def counted(theta, seeds):
        with lock:
            flying[0] += 1
            most[0] = max(most[0], flying[0])
        if int(seeds[0]) in first:
            together.wait(30.0)
        time.sleep(0.01)
        with lock:
            flying[0] -= 1
        return simulate(theta, seeds)

    with ThreadPoolExecutor(4) as pool:
        fit = inference.fit(counted, prior, observed, **options(pool))
    assert fit.failures == {}
    assert most[0] == 3


@pytest.mark.slow
def test_a_dead_worker_is_explained_and_the_rest_is_kept(
    tmp_path, prior, observed, by_hand, worker_side
):
    path, mended = tmp_path / "b.sqlite", tmp_path / "mended"
    simulate = worker_side.Deadly(str(mended), simulation_seed(0, 6))
    with spawned(2) as pool, pytest.raises(RuntimeError) as caught:
        inference.fit(simulate, prior, observed, bank=path, identity="line", **options(pool))
    for part in ("lost its workers", f"seed {simulation_seed(0, 6)}", str(path), "new executor"):
        assert part in str(caught.value)
    with inference.SimulationBank(path) as bank:
        assert 4 <= len(bank) <= 8  # 0 to 3 were told before 6 was asked
    mended.touch()
    with spawned(2) as pool:
        fit = inference.fit(simulate, prior, observed, bank=path, identity="line", **options(pool))
    assert_same(fit, by_hand)


@pytest.mark.slow  # Dask tries a worker four times
def test_a_worker_of_dask_that_dies_costs_one_run(tmp_path, prior, observed, worker_side):
    simulate = worker_side.Deadly(str(tmp_path / "never"), simulation_seed(0, 6))
    local = {"processes": True, "n_workers": 2, "threads_per_worker": 1}
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        LocalCluster(**local, dashboard_address=":0", silence_logs=50) as cluster,
        cluster.get_client() as client,
    ):
        fit = inference.fit(simulate, prior, observed, **options(client.get_executor()))
    assert fit.failures == {"raised": 1}
    assert str(fit.simulations["error"][6].item()).startswith("KilledWorker: ")


def test_a_simulator_that_cannot_travel_is_explained(prior, observed, simulate):
    with spawned(1) as pool, pytest.raises(TypeError, match="simulate must be picklable"):
        inference.fit(lambda theta, seeds: None, prior, observed, **options(pool))


class Strict(Executor):
    """Takes no work, for a reason of its own."""

    def submit(self, work, /):
        raise TypeError("work must be a str")


def test_another_error_of_an_executor_is_told_as_it_is(worker_side, prior, observed, simulate):
    """A simulator that travels is not blamed."""
    with pytest.raises(TypeError) as caught:
        inference.fit(worker_side.simulate, prior, observed, **options(Strict()))
    assert caught.value.args == ("work must be a str",) and caught.value.__cause__ is None


def test_after_an_error_the_bank_is_free_for_the_next_call(prior, observed, simulate):
    """What was claimed is released, and what was running is stored, though nobody waits."""
    running, finish = threading.Event(), threading.Event()
    first = [simulation_seed(0, index) for index in range(BATCH)]

    def misshapen(theta, seeds):
        if int(seeds[0]) not in first:
            running.set()
            finish.wait(30.0)
            return simulate(theta, seeds)
        if int(seeds[0]) == first[-1]:
            running.wait(30.0)
        return np.zeros(3)

    with inference.SimulationBank() as bank:
        with ThreadPoolExecutor(2) as pool:
            with pytest.raises(ValueError, match="signals of shape"):
                inference.fit(
                    misshapen, prior, observed, bank=bank, identity="line", **options(pool)
                )
            finish.set()
        assert 1 <= len(bank) <= 2  # the other worker may have begun another
        five = {"budget": 5, "initial": 5, "confirm": 0, "warn": False}
        fit = inference.fit(simulate, prior, observed, bank=bank, identity="line", **five)
    assert fit.failures == {}


def test_runs_at_the_same_time_share_what_they_simulate(prior, observed, simulate):
    """Two observations, one bank and one pool: the start designs coincide and run once."""
    calls = []

    def counted(theta, seeds):
        time.sleep(0.02)
        calls.append((theta["slope"][0], theta["offset"][0], seeds[0]))
        return simulate(theta, seeds)

    def run(shift):
        given = {**options(pool), "bank": bank, "identity": "line"}
        return inference.fit(counted, prior, observed + shift, **given)

    with (
        inference.SimulationBank() as bank,
        ThreadPoolExecutor(3) as pool,
        ThreadPoolExecutor(2) as runs,
    ):
        low, high = runs.map(run, [0.0, 0.3])
        assert len(calls) == len(set(calls)) == len(bank)
    np.testing.assert_array_equal(low.history.signals[:INITIAL], high.history.signals[:INITIAL])
    assert low.best != high.best


def test_an_address_where_nobody_answers(prior, observed, simulate):
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "200ms"}),
        pytest.raises(ConnectionError, match="no Dask scheduler answers at 'tcp://127.0.0.1:9'"),
    ):
        inference.fit(simulate, prior, observed, executor="tcp://127.0.0.1:9")


def test_without_dask_the_extra_is_named(prior, observed, simulate, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"pip install 'bolfi-liquids\[dask\]'"):
        inference.fit(simulate, prior, observed, executor="tcp://host:8786")


SCRIPT = """
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import numpy as np

def simulate(theta, seeds):
    wanted = "jax", "scipy", "xarray", "bolfi_liquids.inference.bolfi", "bolfi_liquids.inference"
    return np.array([[float(name in sys.modules) for name in wanted]])

if __name__ == "__main__":
    import jax
    from bolfi_liquids import inference
    from bolfi_liquids.inference.simulations import Job, Compute, run_missing
    jobs = [Job({"a": 1.0}, 0)]
    with ProcessPoolExecutor(1, mp_context=get_context(sys.argv[1])) as pool:
        with inference.SimulationBank() as bank:
            print(run_missing(simulate, jobs, Compute(bank=bank, executor=pool), (5,))[0].signal)
"""


def test_running_a_simulation_loads_neither_jax_nor_the_engine(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, "script.py", "forkserver"], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.stdout.strip() == "[0. 0. 0. 0. 1.]", done.stderr
