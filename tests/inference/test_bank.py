import sqlite3
import subprocess
import sys

import numpy as np
import pytest

from bolfi_liquids import inference

THETA = {"b": 0.1 + 0.2, "a": 1e-3}


WRITE_50 = """
import sys
import numpy as np
from bolfi_liquids import inference

path, first = sys.argv[1], int(sys.argv[2])
with inference.SimulationBank(path) as bank:
    for seed in range(first, first + 50):
        bank.put("id", {"a": 1.0}, seed, inference.Simulation(np.zeros(3), None, 0.0))
"""


def test_keeps_signals_exactly(tmp_path):
    signal = np.random.default_rng(0).normal(size=(5, 2)).astype(np.float32)
    with inference.SimulationBank(tmp_path / "b.sqlite") as bank:
        bank.put("id", THETA, 7, inference.Simulation(signal, None, 1.5))
    with inference.SimulationBank(tmp_path / "b.sqlite") as bank:
        found = bank.get("id", {"a": 1e-3, "b": 0.1 + 0.2}, 7)
        assert len(bank) == 1
    assert found is not None and found.seconds == 1.5
    assert found.signal.dtype == np.float32
    np.testing.assert_array_equal(found.signal, signal)


@pytest.mark.parametrize(
    ("identity", "theta", "seed"),
    [("other", THETA, 7), ("id", {"a": 1e-3, "b": 0.3}, 7), ("id", THETA, 8)],
)
def test_looks_up_exactly(identity, theta, seed):
    with inference.SimulationBank() as bank:
        bank.put("id", THETA, 7, inference.Simulation(np.zeros(2), None, 0.0))
        assert bank.get(identity, theta, seed) is None


def test_keeps_failures_until_a_signal_comes_and_then_that():
    with inference.SimulationBank() as bank:
        bank.put("id", THETA, 0, inference.Simulation(None, "boom", 0.0))
        assert bank.get("id", THETA, 0) == inference.Simulation(None, "boom", 0.0)
        for value in (1.0, 2.0):
            bank.put("id", THETA, 0, inference.Simulation(np.full(2, value), None, 0.0))
        kept = bank.get("id", THETA, 0)
        assert kept is not None and kept.error is None
        np.testing.assert_array_equal(kept.signal, np.full(2, 1.0))


def test_processes_may_share_a_file(tmp_path):
    path = tmp_path / "shared.sqlite"
    workers = [
        subprocess.Popen([sys.executable, "-c", WRITE_50, str(path), first])
        for first in ("0", "25")
    ]
    assert [worker.wait() for worker in workers] == [0, 0]
    with inference.SimulationBank(path) as bank:
        assert len(bank) == 75


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
