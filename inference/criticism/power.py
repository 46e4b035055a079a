"""Sizes of effects: the smallest that would be found, and the largest that could hide."""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from .._float64 import in_float64
from .experiment import Extension
from .hypothesis import Hypothesis
from .misfit import changes_of, snr_of
from .verdict import CREDIBLE, PRIOR

POWER = 0.8
LIMIT = 0.95
STEPS = np.concatenate([[0.0], np.geomspace(0.005, 0.99, 24)])  # of prior quantiles


class Sensitivity(NamedTuple):
    """Sizes of one effect in these data, as distances of its coefficient from neutral.

    Attributes:
        smallest: Found with the probability `POWER`, whatever its sign; NaN if none is that the
            prior allows.
        limit: Not exceeded with the probability `LIMIT`, by the model in which it acts alone.
    """

    smallest: float
    limit: float


@in_float64
def sensitivity(
    base: Hypothesis, single: Hypothesis, extension: Extension, effects: int
) -> Sensitivity:
    """Sizes of the effect by which `single` goes beyond `base`, one of so many known effects.

    An effect is found if "none" is not among the credible explanations: if its likelihood at its
    best exceeds that of the base model by the odds that this takes, and by the share of its prior
    that explains the data as well. The root of twice that likelihood is normal about the effect's
    signal-to-noise ratio.
    """
    (name,) = single.names
    prior, neutral = single.fit.prior, extension.neutral
    at = {key: np.asarray(value) for key, value in base.best.items()}
    zero = float(prior.to_unit({**at, name: np.asarray(neutral)})[-1])

    def distance(u: float) -> float:
        point = np.append(base.u, u)
        return abs(float(prior.from_unit(point)[name]) - neutral)

    odds = CREDIBLE / (1.0 - CREDIBLE) * PRIOR.none / (PRIOR.one / effects)
    needed = np.sqrt(2.0 * (np.log(odds) - single.occam)) + ndtri(POWER)
    found = []
    for side in (-1, 1):
        u = zero + side * STEPS
        u = u[(u >= 0.0) & (u <= 1.0)]
        if len(u) > 1:
            snr = np.maximum.accumulate(snr_of(base, changes_of(base, single, zero, u)))
            reached = snr[-1] >= needed
            found.append(distance(np.interp(needed, snr, u)) if reached else np.nan)
    ends = single.u[-1] + ndtri(LIMIT) * single.sd[-1] * np.array([-1.0, 1.0])
    ends = np.clip(ends, 1.0 - LIMIT, LIMIT)  # what the data do not tell of is as before
    return Sensitivity(max(found), max(map(distance, ends)))
