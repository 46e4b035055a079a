"""Runs that fail or take too long cost themselves only, and are counted."""

import multiprocessing
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.inference import SimulationBank
from bolfi_liquids.inference.simulations import (
    BatchSimulator,
    Compute,
    Job,
    OneByOne,
    Simulation,
    run_missing,
)
from bolfi_liquids.inference.simulations.failures import timed_out
from bolfi_liquids.inference.simulations.job import run_batch, simulation_seed

from bolfi_liquids import inference

JOBS = [Job({"a": float(a)}, a) for a in range(4)]


@pytest.fixture
def forever():
    """Waits until the test is over, so that no abandoned thread outlives it for long."""
    ended = threading.Event()
    yield lambda: ended.wait(60.0)
    ended.set()


def stuck_at(which, forever, calls=None):
    def simulate(theta, seeds):
        if calls is not None:
            calls.append([int(seed) for seed in seeds])
        if which in seeds:
            forever()
        return theta["a"][:, None]

    return simulate


def test_one_that_takes_too_long_is_given_up(forever):
    started = time.monotonic()
    found = run_batch(stuck_at(2, forever), [JOBS[2]], (1,), 0.1)
    assert found == [Simulation(None, timed_out(0.1), 0.1)]
    assert 0.1 <= time.monotonic() - started < 10.0


def test_a_batch_has_the_time_of_all_and_then_each_its_own(forever):
    calls = []
    found = run_batch(stuck_at(2, forever, calls), JOBS, (1,), 0.3)
    assert calls == [[0, 1, 2, 3], [0], [1], [2], [3]]
    assert [result.error for result in found] == [None, None, timed_out(0.3), None]
    np.testing.assert_array_equal(found[3].signal, [3.0])


def test_a_slow_batch_is_no_failure():
    """Four runs of 0.1 s in one call, with 0.3 s for each."""

    def simulate(theta, seeds):
        calls.append(len(seeds))
        time.sleep(0.1 * len(seeds))
        return theta["a"][:, None]

    calls = []
    found = run_batch(simulate, JOBS, (1,), 0.3)
    assert calls == [4] and all(result.error is None for result in found)
    assert 0.4 <= sum(result.seconds for result in found) < 10.0


@pytest.mark.parametrize(
    ("error", "timeout"),
    [(ValueError("bad"), None), (TimeoutError("of its own"), 30.0), (SystemExit(3), 30.0)],
)
def test_what_the_simulator_raises_is_told_from_a_timeout(error, timeout):
    def simulate(theta, seeds):
        raise error

    (found,) = run_batch(simulate, JOBS[:1], (1,), timeout)
    assert found.signal is None and found.error is not None
    assert found.error.text.startswith(f"{type(error).__name__}: {error} (test_timeout.py, line ")


def test_an_error_that_is_no_text_is_kept_all_the_same():
    def simulate(theta, seeds):
        raise OSError("cannot read \udcff.dat")  # how Python spells a file name that is not UTF-8

    with SimulationBank() as bank:
        (found,) = run_missing(simulate, JOBS[:1], Compute(bank=bank), (1,))
        assert bank.get("", *JOBS[0]) == found
    assert found.error.text.startswith(r"OSError: cannot read \udcff.dat (")


@pytest.mark.parametrize(("allowed", "again"), [(0.1, False), (9.0, True)])
def test_a_timeout_is_final_until_more_time_is_allowed(forever, allowed, again):
    calls = []
    with SimulationBank() as bank:
        first = run_missing(stuck_at(0, forever), JOBS[:1], Compute(bank=bank, timeout=0.1))
        then = run_missing(
            stuck_at(-1, forever, calls), JOBS[:1], Compute(bank=bank, timeout=allowed)
        )
        assert bool(calls) == again
        assert (then == first) == (not again)
        # no limit is more time than any
        (last,) = run_missing(stuck_at(-1, forever), JOBS[:1], Compute(bank=bank))
    np.testing.assert_array_equal(last.signal, [0.0])


class Patient:
    """A simulator that stops itself, as one that must stay in its thread."""

    def __init__(self, seconds):
        self.seconds, self.allowed, self.threads = seconds, 0.0, set()

    @contextmanager
    def time_limit(self, seconds):
        self.allowed = seconds
        yield

    def simulate(self, theta, seeds):
        self.threads.add(threading.current_thread())
        time.sleep(min(self.seconds, self.allowed + 0.01))
        if self.seconds > self.allowed:
            raise TimeoutError("stopped")
        return theta["a"][:, None]


def alone(simulate, theta, seed):
    return simulate({name: np.array([value]) for name, value in theta.items()}, [seed])[0]


@pytest.mark.parametrize("single", [False, True])
def test_a_simulator_that_stops_itself_stays_in_its_thread(single):
    for seconds, error in ((0.0, None), (9.0, timed_out(0.1))):
        patient = Patient(seconds)
        simulate = (
            OneByOne(partial(alone, patient.simulate), patient.time_limit)
            if single
            else BatchSimulator(patient.simulate, time_limit=patient.time_limit)
        )
        (found,) = run_missing(simulate, JOBS[:1], Compute(timeout=0.1))
        assert found.error == error
        assert patient.threads == {threading.current_thread()}


def test_every_kind_is_counted_and_written(tmp_path, prior, observed, simulate, forever):
    """Runs 1, 3 and 4 fail, each in its way; the others are as they would have been."""
    raises, diverges, hangs = (simulation_seed(0, index) for index in (1, 3, 4))

    def fragile(theta, seeds):
        if raises in seeds:
            raise FloatingPointError("blew up")
        if hangs in seeds:
            forever()
        signals = simulate(theta, seeds)
        signals[np.isin(seeds, diverges), 5:] = np.inf
        return signals

    fit = inference.fit(fragile, prior, observed, budget=9, confirm=0, timeout=0.5)
    assert fit.failures == {"raised": 1, "not finite": 1, "timeout": 1}
    expected = [""] * 9
    line = fragile.__code__.co_firstlineno + 2
    expected[1] = f"FloatingPointError: blew up (test_timeout.py, line {line})"
    expected[3] = "not finite: the signal"
    expected[4] = "timeout: no signal after 0.5 s"
    runs = fit.simulations
    assert runs["error"].to_numpy().tolist() == expected
    np.testing.assert_array_equal(runs["failed"], [bool(error) for error in expected])
    plain = inference.fit(simulate, prior, observed, budget=7, confirm=0)
    fine = [0, 2, 5, 6]
    np.testing.assert_array_equal(fit.history.signals[fine], plain.history.signals[fine])
    runs.to_netcdf(tmp_path / "runs.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "runs.nc", engine="h5netcdf") as read:
        assert read["error"].to_numpy().tolist() == expected


def test_a_discrepancy_that_is_not_finite_says_so(prior, observed, simulate):
    def picky(observed, simulated):
        return np.inf if simulated[0] > 0.7 else float(np.sum((observed - simulated) ** 2))

    fit = inference.fit(simulate, prior, observed, budget=7, discrepancy=picky, warn=False)
    failed = fit.history.signals[:, 0] > 0.7
    assert failed.any()
    assert fit.failures == {"not finite": failed.sum()}
    assert set(fit.history.errors[failed]) == {"not finite: the discrepancy"}


def test_the_clock_runs_in_the_worker(tmp_path, monkeypatch):
    """One worker, four runs of 0.3 s, 0.9 s for each: none is late, for queueing costs nothing."""
    (tmp_path / "sleeper.py").write_text(
        "import time\n\ndef sleep(theta, seeds):\n"
        "    time.sleep(float(theta['a'][0]))\n    return theta['a'][:, None]\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    import sleeper

    batch = [Job({"a": 0.3}, seed) for seed in range(4)] + [Job({"a": 30.0}, 4)]
    context = multiprocessing.get_context("spawn")
    with SimulationBank() as bank, ProcessPoolExecutor(1, mp_context=context) as pool:
        found = run_missing(sleeper.sleep, batch, Compute(bank=bank, executor=pool, timeout=0.9))
    assert [result.error for result in found] == [None] * 4 + [timed_out(0.9)]
