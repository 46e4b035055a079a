"""How often criticism is right, on the data sets of every subject.

    python tests/benchmarks/misfit/study.py misfit_sets --out study.jsonl --workers 2

Each line of the file is one data set; a study that was interrupted goes on where it stopped.
`table.py` makes a table of it.
"""

import argparse
import os
import sys
import time
import traceback
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))

from bolfi_liquids.inference import criticism
from data_sets import DataSet, files
from kept import keep, results
from machine import machine
from subject import alone
from subjects import SUBJECTS

DRAWS = 8  # of a posterior, for its expectation


def examine(one: DataSet) -> dict:
    """Criticise the base model on a data set, and say how that went."""
    started = time.perf_counter()
    known = {
        "subject": one.subject,
        "number": one.number,
        "effects": list(one.effects),
        "truth": one.truth,
        "theta": one.theta,
        "visible": one.visible,
        "snr": one.snr,
    }
    try:
        found = criticise(one)
    except Exception:  # a crash is a result, and the others are still wanted
        return {**known, "crash": traceback.format_exc()}
    return {
        **known,
        "p_value": found.base.check.p_value,
        "verdict": found.verdict.kind,
        "named": list(found.verdict.effects),
        "tied": [list(names) for names in found.tied],
        "compared": [list(names) for names in found.gaps],
        "probabilities": dict(found.probabilities),
        "intervals": {name: list(interval) for name, interval in found.coefficients.items()},
        "gap": _gap(found, one),
        "simulations": found.simulations,
        "seconds": time.perf_counter() - started,
    }


def criticise(one: DataSet) -> criticism.Criticism:
    """With the held-out experiment, and what is known of the noise."""
    subject = SUBJECTS[one.subject]

    def experiment(trial, label: str, observed: np.ndarray, *more: np.ndarray):
        noise = subject.noise([observed, *more])
        return criticism.Experiment(trial.simulate, observed, noise, label, label)

    return criticism.criticise(
        experiment(subject.fitted, "fitted", one.observed),
        subject.prior,
        subject.extensions,
        held_out=[experiment(subject.held_out, "held out", one.held_out, one.observed)],
        batch=64,
        seed=one.seed,
    )


def _gap(found: criticism.Criticism, one: DataSet) -> list[float] | None:
    """RMS of truth less expected on the held-out experiment, both without noise: before, after, in
    units of the noise."""
    if found.extended is None:
        return None
    trial = SUBJECTS[one.subject].held_out
    seen, noise = (
        trial.expected(alone(one.theta))[0],
        np.sqrt(np.trace(trial.covariance(one.theta))),
    )
    posteriors = criticism.weighted_posterior(found.base.hypothesis), found.posterior
    expected = [trial.expected(each.draw(0, DRAWS)).mean(0) for each in posteriors]
    return [float(np.linalg.norm(seen - mean) / noise) for mean in expected]


def run(folder: Path, path: Path, workers: int, first: int | None) -> Iterator[dict]:
    """Finish the study; yields each data set's result as it is kept."""
    done = {(r["subject"], r["number"]) for r in results(path)}
    sets = [one for file in files(folder) for one in file[:first]]
    left = [one for one in sets if (one.subject, one.number) not in done]
    left.sort(key=lambda one: one.number)
    made = machine()
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for result in pool.map(examine, left, chunksize=4):
            result["made"] = made
            keep(path, result)
            yield result


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sets", type=Path, help="folder that data_sets.py wrote")
    parser.add_argument("--out", type=Path, default=Path("study.jsonl"))
    parser.add_argument("--first", type=int, help="how many sets of each subject; all by default")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    for count, _ in enumerate(run(asked.sets, asked.out, asked.workers, asked.first), 1):
        print(f"\r{count}", end="", file=sys.stderr, flush=True)
