"""Residual of the base model on clean data."""

from typing import NamedTuple

import numpy as np

from ..prior import Prior
from ..simulations.compute import Compute
from .experiment import Experiment
from .model_extension import Extensions
from .prior_boxes import everywhere
from .runs import joined
from .study import Plan, Report, Study, silent

CLEAN_PASSES = 2  # of runs where the model fits best: so far, and with what the first taught
CLEAN_RUNS = 2  # of each; the mean of the last is free of the emulator's error


class OwnResidual(NamedTuple):
    """A residual, and where the model leaves it.

    Attributes:
        residual: Observed less the model's expectation [*signal_shape], NaN where missing.
        best: The most probable parameters.
    """

    residual: np.ndarray
    best: dict[str, float]


def own_residual(
    experiment: Experiment,
    prior: Prior,
    extensions: Extensions,
    compute: Compute,
    *,
    report: Report = silent,
    start: int = Plan.start,
) -> OwnResidual:
    """Residual of the calibrated base model on data in which no effect is expected.

    Args:
        compute: Where runs are made and kept.
        report: Called with the phase, the number of simulations finished in it since the last
            call, and their number in all.
        start: Runs all over the prior, before those where the model fits best.

    Raises:
        RuntimeError: every simulation failed, or the executor lost its workers.
    """
    study = Study(experiment, prior, extensions, compute, Plan(start=start), report=report)
    whole = everywhere(len(prior))
    made = study.run("start", study.points(whole, (), start))
    runs = [made]
    fits = [study.hypothesis((), made, whole)]
    for attempt in range(CLEAN_PASSES):
        at_best = {name: np.full(CLEAN_RUNS, value) for name, value in fits[-1].best.items()}
        made = study.run(f"best {attempt}", at_best)
        runs.append(made)
        fits.append(study.hypothesis((), joined(runs), whole))
    before, fitted = fits[-2:]
    now, then = fitted.expected(np.stack([fitted.u, before.u]))
    moved = fitted.surrogate.output.restore((now - then)[None])[0]
    return OwnResidual(experiment.observed - made.signals.mean(0) - moved, fitted.best)
