"""What a simulator returns: converted, or refused as the one run that it is, wherever it ran."""

import contextlib
import importlib
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from decimal import Decimal

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from bolfi_liquids.inference.arguments import Unusable, float64
from bolfi_liquids.inference.simulations import (
    Compute,
    Job,
    OneByOne,
    Simulation,
    jobs,
    run_missing,
)
from bolfi_liquids.inference.simulations.failures import FailureKind
from bolfi_liquids.inference.simulations.job import BATCH
from dask.array.ma import masked_array as masked_chunks
from distributed import LocalCluster

from bolfi_liquids import inference

MASKED = np.ma.masked_array([1.0, 1e36], [False, True])

NUMBERS = {
    "booleans": ([True, False], [1.0, 0.0]),
    "objects": (np.array([1, Decimal("2.5")], object), [1.0, 2.5]),
    "a missing object": (np.array([1.0, None], object), [1.0, np.nan]),
    "masked": (MASKED, [1.0, np.nan]),
    "a list of masked rows": ([MASKED, MASKED], [[1.0, np.nan]] * 2),
    "lists of masked rows": ([[MASKED, MASKED]] * 2, [[[1.0, np.nan]] * 2] * 2),
    "tuples of masked rows, and others": (
        ([(MASKED,)], [[[3, 4]]]),
        [[[[1.0, np.nan]]], [[[3, 4]]]],
    ),
    "the constant in a row": ([[1.0, np.ma.masked], [2.0, 3.0]], [[1.0, np.nan], [2.0, 3.0]]),
    "pandas.NA": ([[1.0, pd.NA], [2.0, 3.0]], [[1.0, np.nan], [2.0, 3.0]]),
    "a nullable column": (pd.Series([1, None], dtype="Int64"), [1.0, np.nan]),
    "nullable columns": (pd.DataFrame({"x": [1.5, None]}, dtype="Float64"), [[1.5], [np.nan]]),
    "labelled and masked": (xr.DataArray(MASKED, dims="time"), [1.0, np.nan]),
    "labelled chunks that are masked": (
        xr.DataArray(masked_chunks([1.0, 1e36], [False, True])),
        [1.0, np.nan],
    ),
    "a list of chunks that are masked": (
        [masked_chunks([1.0, 1e36], [False, True])],
        [[1.0, np.nan]],
    ),
    "labelled": (xr.DataArray([1.0, 2.0], dims="time"), [1.0, 2.0]),
    "a table": (pd.DataFrame({"x": [1, 2], "y": [3, 4]}), [[1.0, 3.0], [2.0, 4.0]]),
    "a row of lists": ([[1, 2], [3, 4]], [[1.0, 2.0], [3.0, 4.0]]),
    "too large": ([1, 10**400], [1.0, np.inf]),
    "too large for float64": (np.array([1, "1e4000"], np.longdouble), [1.0, np.inf]),
}


@pytest.mark.filterwarnings("ignore:Warning. converting a masked element")  # NumPy says so
def test_numbers_of_any_kind_become_float64():
    for case, (given, due) in NUMBERS.items():
        with np.errstate(all="raise"):  # as a user may have it
            found = float64(given)
        assert found.dtype == np.float64 and type(found) is np.ndarray, case
        np.testing.assert_array_equal(found, np.array(due), err_msg=case)


OTHERS = {
    "nothing": None,
    "complex": np.array([1.0 + 0.0j, 2.0]),
    "complex objects": np.array([1.0, np.complex64(2.0)], object),
    "text": np.array(["1", "2"]),
    "a word": "done",
    "text among objects": np.array(["1", 2.0], object),
    "dates": np.array(["2026-01-01"], "datetime64[s]"),
    "records": np.zeros(2, [("x", float)]),
    "ragged": [[1.0, 2.0], [1.0]],
    "a mapping": {"x": [1.0, 2.0]},
    "a set": {1.0, 2.0},
    "a generator": (value for value in (1.0, 2.0)),
    "masked complex numbers in a list": [[np.ma.masked_array([1j, 2.0], [True, False])]],
    "times that are missing": np.array([1.0, pd.NaT], object),
    "rows of objects": np.array([np.zeros(2), np.zeros(1)], object),
}


def test_what_would_lose_or_invent_something_is_refused():
    taken = []
    for case, given in OTHERS.items():
        with contextlib.suppress(Unusable):
            taken.append((case, float64(given)))
    assert not taken


def test_integers_of_any_library_are_python_s_own():
    for seed in (np.int64(7), np.uint8(7), np.array(7), 7):
        (job,) = jobs({}, [seed])
        assert job == Job({}, 7) and type(job.seed) is int


WORKER_SIDE = """
import random
import numpy as np

def signal(theta, seed):
    return theta["a"] * np.arange(5.0) + seed

SPOILT = {
    "shorter": lambda good: good[:4],
    "longer": lambda good: np.append(good, 0.0),
    "with another axis": lambda good: good[None, :, None],
    "nothing": lambda good: None,
    "a mapping": lambda good: {"signal": good},
    "text": lambda good: [str(value) for value in good],
    "complex": lambda good: good + 0j,
    "ragged": lambda good: [[1.0, 2.0], [1.0]],
    "one number": lambda good: 1.0,
}

class One:
    '''Of single runs; that of one seed is spoilt.'''
    def __init__(self, how, seed):
        self.how, self.seed = how, seed

    def __call__(self, theta, seed):
        random.seed(seed)  # which takes no integer of NumPy's
        good = signal(theta, seed)
        return SPOILT[self.how](good) if seed == self.seed else good.tolist()

class Many(One):
    def __call__(self, theta, seeds):
        rows = [One.__call__(self, {"a": a}, int(s)) for a, s in zip(theta["a"], seeds)]
        return rows
"""


@pytest.fixture
def worker_side(tmp_path, monkeypatch):
    """A module that spawned workers find, for they are given this process's path."""
    (tmp_path / "worker_side.py").write_text(WORKER_SIDE)
    monkeypatch.syspath_prepend(tmp_path)
    yield importlib.import_module("worker_side")
    sys.modules.pop("worker_side")


@contextmanager
def nowhere_else():
    yield None


@contextmanager
def threads():
    with ThreadPoolExecutor(2) as pool:
        yield pool


@contextmanager
def processes():
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield pool


@contextmanager
def dask():
    local = {"processes": False, "n_workers": 1, "threads_per_worker": 2, "protocol": "tcp://"}
    with LocalCluster(**local, dashboard_address=":0") as cluster, cluster.get_client() as client:
        yield client.get_executor(pure=False)


PLACES = [
    nowhere_else,
    threads,
    pytest.param(processes, marks=pytest.mark.slow),
    pytest.param(dask, marks=pytest.mark.slow),
]
HOW = [
    *("shorter", "longer", "with another axis", "nothing", "a mapping", "text", "complex"),
    *("ragged", "one number"),
]
SPOILT_SEED = 12
JOBS = jobs({"a": np.arange(8.0)}, np.arange(10, 18))


@pytest.mark.parametrize(("single", "shape"), [(True, (5,)), (False, None)])
@pytest.mark.parametrize("place", PLACES)
def test_a_run_without_a_signal_costs_itself_alone(worker_side, place, single, shape):
    with place() as executor:
        for how in HOW:
            made = OneByOne(worker_side.One(how, SPOILT_SEED)) if single else None
            simulate = made or worker_side.Many(how, SPOILT_SEED)
            with inference.SimulationBank() as bank:
                found = run_missing(
                    simulate, JOBS, Compute(bank=bank, batch=4, executor=executor), shape
                )
                kept = bank.get("", JOBS[2].theta, SPOILT_SEED)
            for job, one in zip(JOBS, found, strict=True):
                if job.seed != SPOILT_SEED:
                    assert one.error is None, how
                    np.testing.assert_array_equal(
                        one.signal, worker_side.signal(job.theta, job.seed)
                    )
                    continue
                assert one.signal is None and one.error is not None, how
                assert one.error.kind is FailureKind.UNUSABLE
                text = one.error.text
                assert str(job.theta["a"]) in text and str(SPOILT_SEED) in text
                assert "(4,)" in text or "(1, 4)" in text or how != "shorter"
            if shape is not None:
                assert kept is None  # the next call tries it again


def test_a_fit_ends_only_if_none_of_the_first_runs_gives_a_signal(prior, observed, simulate):
    """Without a cure it would end at each repetition, and with a bank at the same run."""

    def spoilt(*places):
        def one(theta, seed):
            made.append(seed)
            signal = simulate({k: np.array([v]) for k, v in theta.items()}, [seed])[0]
            return signal[:29] if len(made) - 1 in places else signal

        made = []
        return one

    options = {"budget": 9, "batch": 3, "vectorised": False}
    fit = inference.fit(spoilt(0, 1, 7), prior, observed, **options)
    assert fit.failures == {"unusable": 3}
    failed = np.flatnonzero(fit.simulations["failed"].to_numpy())
    assert failed.tolist() == [0, 1, 7]
    for row in failed:
        told = str(fit.simulations["error"][row].item())
        assert "(30,)" in told and "(29,)" in told
        assert str(int(fit.simulations["seed"][row])) in told
    later = inference.fit(spoilt(6, 7, 8), prior, observed, **options)
    assert later.failures == {"unusable": 3}
    with pytest.raises(ValueError, match=r"of shape \(30,\), got \(29,\)"):
        inference.fit(spoilt(*range(BATCH)), prior, observed, **options)
    alone = inference.fit(spoilt(0), prior, observed, **(options | {"batch": 1}))
    assert alone.failures == {"unusable": 1}


def test_a_masked_value_is_a_missing_one(prior, observed, simulate):
    """The value behind a mask is not learned from."""

    def masked(theta, seeds):
        signals = np.ma.masked_array(simulate(theta, seeds))
        signals[seeds == hidden, 3] = np.ma.masked
        return signals

    hidden = int(inference.fit(simulate, prior, observed, budget=7).history.seeds[2])
    fit = inference.fit(masked, prior, observed, budget=7)
    assert fit.failures == {"not finite": 1}
    assert np.isnan(fit.history.signals[2, 3]) and fit.history.seeds[2] == hidden


def test_a_simulator_may_fill_the_same_array_again(prior, observed, simulate):
    """With several in flight, signals are told after others were made."""
    buffer = np.empty((1, 30))

    def thrifty(theta, seeds):
        buffer[:] = simulate(theta, seeds)
        return buffer

    options = {"budget": 7, "batch": 3, "in_rounds": False}
    reused = inference.fit(thrifty, prior, observed, **options)
    fresh = inference.fit(simulate, prior, observed, **options)
    np.testing.assert_array_equal(reused.history.signals, fresh.history.signals)


def test_another_simulator_s_signal_in_the_bank_costs_itself_alone():
    with inference.SimulationBank() as bank:
        bank.put("", JOBS[3].theta, JOBS[3].seed, Simulation(np.zeros(9), None, 0.0))
        found = run_missing(
            lambda theta, seeds: np.zeros((len(seeds), 5)), JOBS, Compute(bank=bank, batch=4), (5,)
        )
    assert [one.signal is None for one in found] == [False] * 3 + [True] + [False] * 4
    assert "(9,)" in str(found[3].error)


def test_a_bad_signal_among_those_that_are_told_is_a_failed_run(prior, observed, simulate):
    engine = inference.Bolfi(prior, observed)
    theta = engine.ask(6)
    good = list(simulate(theta, range(6)))
    engine.tell(theta, [good[0], None, good[2][:29], good[3] + 0j, good[4], "diverged"])
    assert engine.told == 6 and engine.succeeded == 2
    assert [error.partition(":")[0] for error in engine.history.errors if error] == ["unusable"] * 4
    with pytest.raises(ValueError, match=r"signals .*\(6, 30\)"):
        engine.tell(theta, [row[:29] for row in good])
    assert engine.told == 6


def test_a_discrepancy_that_is_no_real_number_is_refused(prior, observed, simulate):
    with pytest.raises(ValueError, match="what discrepancy returns must be an array of numbers"):
        inference.fit(
            simulate, prior, observed, budget=7, discrepancy=lambda a, b: np.sum((a - b) ** 2) + 0j
        )


def draws_of_prior(observed, seed):
    rng = np.random.default_rng(seed)
    return {"slope": rng.uniform(-1.0, 1.0, 31), "offset": rng.random(31)}


def test_observations_of_replicates_are_numbers_by_the_same_rules(prior, simulate):
    def observe(signal, rng):
        made.append(signal)
        return signal + 0j if len(made) in broken else np.ma.masked_less(signal, signal.mean())

    made, broken, options = [], {2}, {"draws": 15, "independent": True, "progress": False}
    found = inference.replicates(draws_of_prior, simulate, prior, 4, observe=observe, **options)
    assert [one.number for one in found.failed] == [1]
    assert "complex" in str(found.failed[0].error)
    for one in found.finished:
        signal = made[one.number]
        np.testing.assert_array_equal(np.isnan(one.observed), signal < signal.mean())
    made.clear()
    broken |= {1, 3, 4}
    with pytest.raises(ValueError, match="complex"):
        inference.replicates(draws_of_prior, simulate, prior, 4, observe=observe, **options)
