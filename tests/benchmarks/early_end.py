"""What `budget="auto"` saves and loses, against as many simulations as it may make.

    .venv/bin/python tests/benchmarks/early_end.py --tasks gauss2 pendobs --seeds 12

Prints a line for each task: the mean number of simulations, the median total variation to the
exact posterior at that end and at `Until.most`, and in how many seeds an end of a 90 % interval was
off by more than twice the tolerance, in the posterior's sds.
"""

import argparse
from typing import NamedTuple

import numpy as np
from bolfi_liquids.inference.interval_error import ENDS
from bolfi_liquids.inference.sampling.importance import weighted_quantiles
from engines import OURS
from peers.job import Job
from peers.run_ours import CALL, Question, question
from scipy.special import softmax
from tasks import TASKS, Reference, make_reference, score
from tasks.reference import mean_and_sd

from bolfi_liquids import inference

USUAL = ["gauss2", "pendobs", "ball_drop", "boarding_school", "pend2", "ma2"]


class Ended(NamedTuple):
    """A fit beside the exact posterior.

    Attributes:
        simulations: Made for it.
        total_variation: To the exact posterior.
        off: By which an end of a 90 % interval is wrong at most, in the posterior's sds.
    """

    simulations: int
    total_variation: float
    off: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", nargs="+", choices=TASKS, default=USUAL)
    parser.add_argument("--seeds", type=int, default=50)
    given = parser.parse_args()
    until = inference.Until()
    found = {}
    for name in given.tasks:
        found[name] = [pair(name, seed, until) for seed in range(given.seeds)]
        print(told(name, np.array(found[name]), until), flush=True)
    print(told("all", np.concatenate([np.array(pairs) for pairs in found.values()]), until))


def pair(name: str, seed: int, until: inference.Until) -> tuple[Ended, Ended]:
    """A fit that ends early, and the one with all simulations."""
    task = TASKS[name]
    observed = task.observe(seed)
    reference = make_reference(task, observed)
    job = Job(OURS[0], "posterior", name, seed, (), seed, False, "", "", 0)
    asked = question(job, task, observed)
    return ended(asked, reference, until), ended(asked, reference, until.most)


def ended(asked: Question, reference: Reference, budget: int | inference.Until) -> Ended:
    fit = inference.fit(
        asked.simulate, asked.prior, asked.observed, budget=budget, **CALL, **asked.options
    )
    log_density = fit.log_prob(asked.prior.to_dict(reference.points))
    mass = softmax(log_density + np.log(reference.volume))
    own, exact = (
        [weighted_quantiles(column, weights, ENDS) for column in reference.points.T]
        for weights in (mass, reference.mass)
    )
    _, sd = mean_and_sd(reference.points, mass)
    off = np.max(np.abs(np.subtract(own, exact)) / sd[:, None])
    return Ended(len(fit.history.theta), score(log_density, reference).total_variation, float(off))


def told(name: str, pairs: np.ndarray, until: inference.Until) -> str:
    """A line about pairs [seeds, 2, 3]."""
    early, whole = pairs[:, 0], pairs[:, 1]
    worse = np.median(early[:, 1] - whole[:, 1])
    bad, as_bad = (np.mean(each[:, 2] > 2.0 * until.tolerance) for each in (early, whole))
    return (
        f"{name}: {early[:, 0].mean() / until.most:.2f} of {until.most} simulations, "
        f"TV {np.median(early[:, 1]):.3f} and {np.median(whole[:, 1]):.3f} at the whole, "
        f"{worse:+.3f} in the median; off by more than twice the tolerance {bad:.0%}, "
        f"and {as_bad:.0%} at the whole"
    )


if __name__ == "__main__":
    main()
