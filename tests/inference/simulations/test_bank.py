"""What a bank keeps, for whom, and that nothing is simulated twice."""

import re
import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import numpy as np
import pytest
from bolfi_liquids.inference import simulations
from bolfi_liquids.inference.simulations import Compute, open_compute, run_missing
from bolfi_liquids.inference.simulations.failures import raised

from bolfi_liquids import inference

BOOM = raised(OSError("boom"))
THETA = {"b": 0.1 + 0.2, "a": 1e-3}


def test_keeps_signals_exactly(tmp_path):
    signal = np.random.default_rng(0).normal(size=(5, 2)).astype(np.float32)
    with inference.SimulationBank(tmp_path / "b.sqlite") as bank:
        bank.put("id", THETA, 7, simulations.Simulation(signal, None, 1.5))
    with inference.SimulationBank(tmp_path / "b.sqlite") as bank:
        found = bank.get("id", {"a": 1e-3, "b": 0.1 + 0.2}, 7)
        assert len(bank) == 1
    assert found is not None and found.seconds == 1.5
    assert found.signal.dtype == np.float32
    np.testing.assert_array_equal(found.signal, signal)


def test_looks_up_exactly():
    others = [("other", THETA, 7), ("id", {"a": 1e-3, "b": 0.3}, 7), ("id", THETA, 8)]
    with inference.SimulationBank() as bank:
        bank.put("id", THETA, 7, simulations.Simulation(np.zeros(2), None, 0.0))
        assert bank.holds("id") and not bank.holds("other")
        assert [bank.get(*key) for key in others] == [None] * 3


def test_keeps_failures_until_a_signal_comes_and_then_that():
    with inference.SimulationBank() as bank:
        bank.put("id", THETA, 0, simulations.Simulation(None, BOOM, 0.0))
        assert bank.get("id", THETA, 0) == simulations.Simulation(None, BOOM, 0.0)
        for value in (1.0, 2.0):
            bank.put("id", THETA, 0, simulations.Simulation(np.full(2, value), None, 0.0))
        kept = bank.get("id", THETA, 0)
        assert kept is not None and kept.error is None
        np.testing.assert_array_equal(kept.signal, np.full(2, 1.0))


def test_other_files_are_refused_and_left_alone(tmp_path):
    text, foreign = tmp_path / "notes.txt", tmp_path / "other.sqlite"
    text.write_text("not a database, but long enough to be read as a header of one " * 20)
    connection = sqlite3.connect(foreign)
    connection.execute("CREATE TABLE mine (x)")
    connection.commit()
    connection.close()
    before = foreign.read_bytes(), text.read_bytes()
    for path in (text, foreign):
        with pytest.raises(ValueError, match="not a simulation bank"):
            inference.SimulationBank(path)
    assert (foreign.read_bytes(), text.read_bytes()) == before


@pytest.mark.parametrize("kind", ["simulation bank", "replicate store"])
def test_a_path_that_cannot_be_used_is_named(tmp_path, simulate, prior, kind):
    path = tmp_path / "missing" / "b.sqlite"
    message = rf"{re.escape(str(path))} cannot be used as a {kind} \(unable to open"
    with pytest.raises(ValueError, match=message):
        if kind == "simulation bank":
            inference.fit(simulate, prior, np.zeros(30), bank=path, identity="line")
        else:
            inference.replicates(print, simulate, prior, 2, store=path, identity="line")


def test_all_simulations_of_one_identity(tmp_path):
    """In an order that does not depend on who finished first; other identities stay out."""
    rows = [("id", 0.1, 5), ("id", 0.3, 1), ("id", 0.1, 2), ("other", 0.2, 0)]
    found = []
    for order in (rows, rows[::-1]):
        with inference.SimulationBank() as bank:
            for identity, a, seed in order:
                signal = np.array([[a, np.nan], [seed, 1.0]])
                bank.put(
                    identity, {"b": 1.0, "a": a}, seed, simulations.Simulation(signal, None, 0.0)
                )
            bank.put("id", {"b": 2.0, "a": 0.0}, 7, simulations.Simulation(None, BOOM, 0.0))
            found.append(bank.simulations("id"))
    for kept in found:
        np.testing.assert_array_equal(kept.theta["a"], [0.1, 0.1, 0.3])
        np.testing.assert_array_equal(kept.theta["b"], [1.0, 1.0, 1.0])
        np.testing.assert_array_equal(kept.seeds, [2, 5, 1])
        np.testing.assert_array_equal(kept.signals[:, 1, 0], kept.seeds)
        np.testing.assert_array_equal(kept.signals[:, 0, 0], kept.theta["a"])


def test_simulations_that_are_not_alike_are_refused():
    with inference.SimulationBank() as bank:
        with pytest.raises(ValueError, match="identity='id', got none$"):
            bank.simulations("id")
        for a in (2, 3):
            bank.put("id", {"a": a}, 0, simulations.Simulation(np.zeros(a), None, 0.0))
        with pytest.raises(ValueError, match=r"a -> \[2\].*a -> \[3\]"):
            bank.simulations("id")


def test_a_claim_excludes_all_others_until_released(tmp_path):
    path = tmp_path / "b.sqlite"
    with inference.SimulationBank(path) as one, inference.SimulationBank(path) as two:
        assert one.claim("id", THETA, 0)
        assert not one.claim("id", THETA, 0) and not two.claim("id", THETA, 0)
        assert two.claim("id", THETA, 1) and two.claim("id2", THETA, 0)
        one.release("id", THETA, 0)
        one.release("id", THETA, 0)
        assert two.claim("id", THETA, 0)
    with inference.SimulationBank(path) as bank:
        assert bank.claim("id", THETA, 0)


HOLD = """
import sys, time
from bolfi_liquids import inference
from bolfi_liquids.inference import simulations

bank = inference.SimulationBank(sys.argv[1])
print(bank.claim("id", {"a": 1.0}, 0), flush=True)
time.sleep(60.0)
"""


def test_a_claim_of_a_process_ends_with_it(tmp_path):
    """By SIGKILL, too; and opening or closing the bank elsewhere leaves it as it is."""
    path = tmp_path / "b.sqlite"
    command = [sys.executable, "-c", HOLD, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline().strip() == "True"
        with inference.SimulationBank(path) as bank:
            with inference.SimulationBank(path) as other:
                assert not other.claim("id", {"a": 1.0}, 0)
            assert not bank.claim("id", {"a": 1.0}, 0)
            holder.kill()
            holder.wait()
            assert bank.claim("id", {"a": 1.0}, 0)
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as late:
                assert late.stdout.readline().strip() == "False"
                late.kill()


WRITE_50 = """
import sys
import numpy as np
from bolfi_liquids import inference
from bolfi_liquids.inference import simulations
with inference.SimulationBank(sys.argv[1]) as bank:
    for seed in range(int(sys.argv[2]), int(sys.argv[2]) + 50):
        bank.put("id", {"a": 1.0}, seed, simulations.Simulation(np.full(20, seed), None, 0.0))
"""


def test_processes_may_write_a_file_at_once(tmp_path):
    """The same rows, too."""
    path = tmp_path / "shared.sqlite"
    workers = [
        subprocess.Popen([sys.executable, "-c", WRITE_50, str(path), first])
        for first in ("0", "25")
    ]
    assert [worker.wait(60.0) for worker in workers] == [0, 0]
    with inference.SimulationBank(path) as bank:
        assert len(bank) == 75
        np.testing.assert_array_equal(bank.simulations("id").signals[:, 0], np.arange(75.0))


TOGETHER = """
import sys, time
from concurrent.futures import ThreadPoolExecutor
import numpy as np
from bolfi_liquids import inference
from bolfi_liquids.inference import simulations
from bolfi_liquids.inference.simulations import Compute, run_missing

def simulate(theta, seeds):
    time.sleep(0.02)
    with open(sys.argv[2], "a") as log:
        log.writelines(f"{seed}\\n" for seed in seeds)
    return np.array([[seed + 0.5] for seed in seeds])

jobs = [simulations.Job({"a": 1.0}, seed) for seed in range(40)]
if sys.argv[3] == "backwards":
    jobs = jobs[::-1]
with inference.SimulationBank(sys.argv[1]) as bank, ThreadPoolExecutor(3) as pool:
    if sys.argv[4] == "alone":
        made = []
        for first in range(0, 40, 4):
            some = jobs[first : first + 4]
            made += run_missing(simulate, some, Compute(bank=bank), identity="own")
    else:
        made = run_missing(
            simulate, jobs, Compute(bank=bank, executor=pool), (1,), identity="own"
        )
assert [m.signal[0] for m in made] == [job.seed + 0.5 for job in jobs]
"""


def test_two_processes_never_simulate_the_same_at_the_same_time(tmp_path):
    """Four runs of the same 40 jobs: two go forwards, two backwards; two with threads, two not."""
    path, log = tmp_path / "b.sqlite", tmp_path / "log"
    runs = [
        subprocess.Popen([sys.executable, "-c", TOGETHER, str(path), str(log), order, how])
        for order in ("forwards", "backwards")
        for how in ("alone", "spread")
    ]
    assert [run.wait(60.0) for run in runs] == [0, 0, 0, 0]
    assert sorted(int(seed) for seed in log.read_text().split()) == list(range(40))


@pytest.mark.parametrize(("batch", "calls"), [(None, [7]), (3, [3, 3, 1])])
def test_results_come_in_order_and_batches_are_kept_as_they_finish(batch, calls):
    made, kept = [], []
    jobs = [simulations.Job({"a": 1.0}, seed) for seed in (5, 3, 9, 1, 7, 2, 8)]

    def simulate(theta, seeds):
        made.append(len(seeds))
        return seeds[:, None] + 0.5

    def interrupted(count):
        kept.append(len(bank))
        if len(kept) == 4:
            raise KeyboardInterrupt

    with inference.SimulationBank() as bank:
        with pytest.raises(KeyboardInterrupt):
            run_missing(simulate, jobs, Compute(bank=bank, batch=batch), advance=interrupted)
        assert kept == ([7] * 4 if batch is None else [3, 3, 3, 6])
        found = run_missing(simulate, jobs, Compute(bank=bank, batch=batch), (1,))
        assert made == calls  # nothing twice
        assert [one.signal[0] for one in found] == [job.seed + 0.5 for job in jobs]


def test_an_executor_takes_jobs_one_by_one_whatever_the_batch():
    made, finished = [], []

    def simulate(theta, seeds):
        made.append(len(seeds))
        return seeds[:, None] + 0.5

    jobs = [simulations.Job({"a": 1.0}, seed) for seed in range(6)]
    with inference.SimulationBank() as bank, ThreadPoolExecutor(2) as pool:
        found = run_missing(
            simulate,
            jobs,
            Compute(bank=bank, batch=4, executor=pool),
            (1,),
            advance=finished.append,
        )
    assert [one.signal[0] for one in found] == [job.seed + 0.5 for job in jobs]
    assert made == finished == [1] * 6


def test_what_was_finished_just_before_the_claim_is_not_simulated():
    class Busy(inference.SimulationBank):
        """Somebody else stores and releases between the look and the claim."""

        def claim(self, identity, theta, seed):
            self.put(identity, theta, seed, simulations.Simulation(np.array([7.0]), None, 0.0))
            return super().claim(identity, theta, seed)

    def simulate(theta, seeds):
        raise AssertionError("it was there")

    with Busy() as bank:
        for _ in range(2):
            (found,) = run_missing(simulate, [simulations.Job(THETA, 0)], Compute(bank=bank), (1,))
            np.testing.assert_array_equal(found.signal, [7.0])
        assert bank.claim("", THETA, 0)  # nobody holds it any more


def test_the_same_job_twice_in_a_batch_is_simulated_once():
    calls = []

    def simulate(theta, seeds):
        calls.extend(seeds)
        return theta["a"][:, None]

    with inference.SimulationBank() as bank:
        batch = [simulations.Job(THETA, seed) for seed in (0, 1, 0)]
        found = run_missing(simulate, batch, Compute(bank=bank), (1,))
    assert calls == [0, 1] and [result.signal[0] for result in found] == [THETA["a"]] * 3


@pytest.mark.parametrize(
    "change",
    [
        "signal = zeroblob(length(signal))",
        "seconds = 2 * seconds",
        "error = 'raised'",
        "shape='[1]'",
    ],
)
def test_a_damaged_row_counts_as_not_simulated(tmp_path, caplog, change):
    path, made = tmp_path / "bank.sqlite", simulations.Simulation(np.arange(3.0) + 1.0, None, 0.5)
    with inference.SimulationBank(path) as bank:
        for seed in (0, 1):
            bank.put("line", THETA, seed, made)
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(f"UPDATE simulation SET {change} WHERE seed = 0")
    with inference.SimulationBank(path) as bank:
        assert len(bank.simulations("line").seeds) == 1
        assert len(bank) == 2  # to read them all writes nothing
        assert bank.get("line", THETA, 0) is None and bank.get("line", THETA, 1) is not None
        assert "damaged row" in caplog.text
        bank.put("line", THETA, 0, made)
        np.testing.assert_array_equal(bank.get("line", THETA, 0).signal, made.signal)


def test_a_bank_that_is_opened_is_closed_and_one_that_is_given_stays_open(tmp_path):
    with open_compute(bank=tmp_path / "runs.sqlite") as compute:
        assert len(compute.bank) == 0
    assert "closed" in repr(compute.bank)
    with inference.SimulationBank() as bank:
        with open_compute(bank=bank) as compute:
            assert compute.bank is bank
        assert len(bank) == 0
