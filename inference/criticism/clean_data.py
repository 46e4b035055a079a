"""Residual of the base model on clean data."""

from typing import NamedTuple

import numpy as np

from ..prior import Prior
from .experiment import Experiment
from .model_extension import Extensions
from .search import Plan, Study, fit_base
from .simulate import Keeping, Laboratory

CLEAN_RUNS = 2  # runs where the model fits best, whose mean is free of the emulator's error


class OwnResidual(NamedTuple):
    """A residual, and where the model leaves it.

    Attributes:
        residual: Observed less the model's expectation [*signal_shape], NaN where missing.
        best: The most probable parameters.
    """

    residual: np.ndarray
    best: dict[str, float]


def own_residual(
    experiment: Experiment, prior: Prior, extensions: Extensions, keeping: Keeping, plan: Plan
) -> OwnResidual:
    """What the calibrated base model leaves of data in which no effect is expected.

    Raises:
        RuntimeError: every simulation failed, or the executor lost its workers.
    """
    with keeping.opened(experiment.identity) as keep:
        laboratory = Laboratory(
            simulate=experiment.simulate,
            prior=prior,
            extensions=extensions,
            keep=keep,
            seed=keeping.seed,
            report=keeping.report,
            shape=experiment.shape,
        )
        study = Study(laboratory, experiment.observed, experiment.noise, plan)
        best = fit_base(study, None)[0].best
        at_best = {name: np.full(CLEAN_RUNS, value) for name, value in best.items()}
        mean = laboratory.run("repeat", at_best).signals.mean(0)
    return OwnResidual(experiment.observed - mean, dict(best))
