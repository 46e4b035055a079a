"""How often criticism is right, on the data sets of every subject.

    python tests/benchmarks/misfit/study.py misfit_sets --out study.jsonl --workers 2

Each line of the file is one data set; a study that was interrupted goes on where it stopped.
`table.py` makes a table of it.
"""

import sys
import time
import traceback
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))

from bolfi_liquids.inference import criticism
from data_sets import DataSet
from every_set import main
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


if __name__ == "__main__":
    main(examine, __doc__, "study.jsonl")
