"""Where to simulate: boxes of prior quantiles, filled evenly."""

from typing import NamedTuple

import numpy as np

from ..prior import Prior
from ..sobol import sobol
from .model_extension import Extension

MIN_POSTERIOR_SDS = 10.0  # posterior sds: narrower boxes make slopes of noise (errors in variables)
FIRST_HALF_WIDTH = 0.25  # half a box's width to begin with
LATER_HALF_WIDTH = 0.08  # later
MAX_HALF_WIDTH = 0.5  # at most
WALL_SHARE = 0.02  # of a box's width, within which a point lies at its wall
PRIOR_END = 0.02  # quantiles from an end of a prior to neutral, within which it is one-sided


class PriorBox(NamedTuple):
    """low, high: prior quantiles [d]."""

    low: np.ndarray
    high: np.ndarray

    def encloses(self, u: np.ndarray) -> bool:
        """Whether u [d] lies inside and at no wall but that of the prior.

        What is best at a wall of a box in which the search was held may be better beyond.
        """
        margin = WALL_SHARE * (self.high - self.low)
        low = np.where(self.low > 0.0, self.low + margin, self.low)
        high = np.where(self.high < 1.0, self.high - margin, self.high)
        return bool(np.all((u >= low) & (u <= high)))


def everywhere(dimension: int) -> PriorBox:
    """All prior quantiles."""
    return PriorBox(np.zeros(dimension), np.ones(dimension))


def hull(one: PriorBox, other: PriorBox) -> PriorBox:
    """The smallest box that holds both."""
    return PriorBox(np.minimum(one.low, other.low), np.maximum(one.high, other.high))


def intersection(one: PriorBox, other: PriorBox) -> PriorBox:
    """The box that both have in common."""
    return PriorBox(np.maximum(one.low, other.low), np.minimum(one.high, other.high))


def around(
    centre: np.ndarray, sd: np.ndarray, least: float, most: float = MAX_HALF_WIDTH
) -> PriorBox:
    """The box about a posterior, from `least` to `most` to each side.

    A missing effect displaces the base parameters by many of their sds, so the first box is wide.
    """
    half = np.clip(MIN_POSTERIOR_SDS * sd, least, most)
    return PriorBox(np.maximum(centre - half, 0.0), np.minimum(centre + half, 1.0))


def sides(extension: Extension, count: int, share: float) -> np.ndarray:
    """Coefficients on alternate sides of neutral, or on its only one, ever nearer to it [count].

    The first lies at a share of the prior quantiles from neutral to the end.
    """
    prior = Prior({"coefficient": extension.prior})
    neutral = float(prior.to_unit({"coefficient": np.asarray(extension.neutral)})[-1])
    ends = [end for end in (0.0, 1.0) if abs(end - neutral) > PRIOR_END]
    shares = share / (1.0 + np.arange(count) // len(ends))
    end = np.resize(ends, count)
    return prior.from_unit((neutral + shares * (end - neutral))[:, None])["coefficient"]


def with_whole_priors(box: PriorBox, count: int) -> PriorBox:
    """The box of the base parameters, and the priors of `count` coefficients, whose neutral values
    may be at an end."""
    return PriorBox(np.append(box.low, np.zeros(count)), np.append(box.high, np.ones(count)))


def fill(box: PriorBox, prior: Prior, seed: int, count: int) -> dict[str, np.ndarray]:
    """`count` points of the box in natural units, name -> [count]."""
    u = sobol(seed, 0, count, len(box.low))
    return prior.from_unit(box.low + (box.high - box.low) * u)
