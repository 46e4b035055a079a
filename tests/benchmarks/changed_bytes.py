"""Single bytes of a run's files are changed: no number that a command prints changes in silence.

    python tests/benchmarks/changed_bytes.py RUN [--count 700] [--seed 0]

RUN holds a calibration, a criticism and a pour. Each change is of one bit of one byte in a copy.
Then what `report --still`, `pour --execute` and `calibrate --resume` read is read again. Counted is
what comes: refused in one sentence, said (in the log, or as a warning of the run), the same
numbers, or one of two faults: other numbers without a word, or an error that is no sentence.
"""

import argparse
import json
import logging
import shutil
import sqlite3
import sys
import tempfile
import warnings
from collections import Counter
from contextlib import closing
from pathlib import Path

import numpy as np
from bolfi_liquids.inference import SimulationBank

import bolfi_liquids as bl
from bolfi_liquids.reporting.warnings import Results, warnings_of
from bolfi_liquids.robot.pour import chosen_pour
from bolfi_liquids.run.run import Run

FILES = (
    "posterior.nc",
    "criticism.nc",
    "pour.nc",
    "simulations.sqlite",
    "run.toml",
    "summary.json",
)


class Said(logging.Handler):
    """Counts what is logged."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.count = 0

    def emit(self, record):
        self.count += 1


def numbers(path):
    """Everything that commands print of a run, and what they say does not count."""
    run = Run.open(path)
    results = Results.of(run)
    parts = [results.calibration, results.criticism, results.pour]
    shown = [one and one.summary.to_json() for one in parts]
    shown.append(results.latest.posterior.to_dict())
    if results.pour is not None:
        shown.append(str(chosen_pour(run)).replace(str(path), "RUN"))
    shown.append([one.inclination.tolist() for one in run.recordings])
    shown.append([str(one) for one in warnings_of(results)])
    return json.dumps(shown, default=str), results.outdated


def simulated(path, expected):
    """The bank's simulations of the calibration; those that it does not hold are made again."""
    with SimulationBank(path) as bank:
        return [bank.get(*key) for key in expected]


def keys_of(path):
    """Identity, theta and seed of all that a bank holds."""
    with closing(sqlite3.connect(path)) as connection:
        rows = connection.execute("SELECT identity, theta, seed FROM simulation").fetchall()
    return [(identity, json.loads(theta), seed) for identity, theta, seed in rows]


def same(one, other):
    """Whether two simulations of the bank are the same, or the second must be made again."""
    if other is None:
        return True
    return one.error == other.error and np.array_equal(one.signal, other.signal, equal_nan=True)


def outcome(path, name, before, keys, bank):
    """What came of a change in the file of this name."""
    said = Said()
    logging.getLogger().addHandler(said)
    try:
        if name == "simulations.sqlite":
            now = simulated(path / name, keys)
            if not all(map(same, bank, now)):
                return "OTHER NUMBERS"
            return "said" if said.count else "the same"
        now, outdated = numbers(path)
        if now == before:
            return "the same"
        return "said" if outdated or said.count else "OTHER NUMBERS"
    except (bl.InputError, ValueError, OSError) as error:
        return "refused" if "\n" not in str(error) else "SEVERAL LINES"
    except Exception as error:
        if isinstance(error, sqlite3.DatabaseError):  # which `Run.bank` turns into a sentence
            return "refused"
        print(f"{name}: {type(error).__name__}: {error}", file=sys.stderr)
        return "TRACEBACK"
    finally:
        logging.getLogger().removeHandler(said)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--count", type=int, default=700)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rng, found = np.random.default_rng(given.seed), {name: Counter() for name in FILES}
    before, _ = numbers(given.run)
    keys = keys_of(given.run / "simulations.sqlite")
    bank = simulated(given.run / "simulations.sqlite", keys)
    for number in range(given.count):
        name = FILES[number % len(FILES)]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(shutil.copytree(given.run, Path(folder) / "run"))
            content = bytearray((path / name).read_bytes())
            at, bit = rng.integers(len(content)), rng.integers(8)
            content[at] ^= 1 << int(bit)
            (path / name).write_bytes(content)
            found[name][outcome(path, name, before, keys, bank)] += 1
    for name, counts in found.items():
        print(f"{name:20s} " + ", ".join(f"{what} {n}" for what, n in counts.most_common()))
    faults = sum(n for counts in found.values() for what, n in counts.items() if what.isupper())
    print(f"faults: {faults} of {given.count}")
    return faults > 0


if __name__ == "__main__":
    sys.exit(main())
