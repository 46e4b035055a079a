"""What a simulator leaves of data that are believed to lack nothing."""

import numpy as np

from ..prior import Prior
from .experiment import Experiment
from .extension import Extensions
from .laboratory import Keeping, Laboratory
from .search import Plan, Study, fit_base


def own_residual(
    experiment: Experiment, prior: Prior, extensions: Extensions, keeping: Keeping, plan: Plan
) -> np.ndarray:
    """Observed less the calibrated base model's expectation [*signal_shape], NaN where missing.

    Raises:
        RuntimeError: every simulation failed.
    """
    laboratory = Laboratory(experiment.simulate, prior, extensions, experiment.identity, keeping)
    study = Study(laboratory, experiment.observed, experiment.noise, plan, keeping.seed)
    fitted = fit_base(study, None)[0]
    return fitted.surrogate.output.restore(fitted.difference[None])[0]
