"""Sizes of effects: the smallest that would be found, and the largest that could hide."""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from .._float64 import in_float64
from ..sampling.importance import weighted_quantiles
from .experiment import Extension
from .hypothesis import Hypothesis
from .misfit import changes_of, snr_of
from .runs import PRIOR_END
from .verdict import PRIOR

POWER = 0.8
LIMIT = 0.95
STEPS = np.concatenate([[0.0], np.geomspace(0.005, 0.99, 24)])  # of the way to a prior's end
GRID = 2000  # prior quantiles of which a limit is taken


class Sensitivity(NamedTuple):
    """Sizes of one effect: distances of its coefficient from neutral, in the coefficient's unit.

    Attributes:
        smallest: Smallest size that these data reveal with the probability `POWER`, whatever its
            sign; NaN if they reveal no size that the prior allows.
        limit: Size that the effect does not exceed with the probability `LIMIT`, if it acts alone.
    """

    smallest: float
    limit: float


@in_float64
def sensitivity(
    base: Hypothesis, single: Hypothesis, extension: Extension, effects: int
) -> Sensitivity:
    """Sizes of the effect by which `single` goes beyond `base`; there are `effects` known effects.

    An effect is found if it is more probable than "none": its likelihood at its best exceeds that
    of the base model by the odds of their priors, and by the share of its prior that explains the
    data as well. The root of twice that likelihood is normal about the effect's signal-to-noise
    ratio.
    """
    (name,) = single.names
    prior, neutral = single.fit.prior, extension.neutral
    at = {key: np.asarray(value) for key, value in base.best.items()}
    zero = float(prior.to_unit({**at, name: np.asarray(neutral)})[-1])

    def distance(u: np.ndarray) -> np.ndarray:
        points = np.column_stack([np.tile(base.u, (len(u), 1)), u])
        return np.abs(prior.from_unit(points)[name] - neutral)

    odds = PRIOR.none / PRIOR.share(1, effects)
    needed = np.sqrt(2.0 * (np.log(odds) - single.occam)) + ndtri(POWER)
    found = []
    for end in (0.0, 1.0):
        if abs(end - zero) > PRIOR_END:
            u = zero + (end - zero) * STEPS
            snr = np.maximum.accumulate(snr_of(base, changes_of(base, single, zero, u)))
            size = distance(np.interp([needed], snr, u))
            found.append(size.item() if snr[-1] >= needed else np.nan)
    grid = (np.arange(GRID) + 0.5) / GRID
    weight = np.exp(-0.5 * ((grid - single.u[-1]) / single.coefficient_sds[-1]) ** 2)
    (limit,) = weighted_quantiles(distance(grid), weight / weight.sum(), (LIMIT,))
    return Sensitivity(float(np.max(found)), float(limit))
