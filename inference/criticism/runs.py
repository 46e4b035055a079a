"""Simulations of a model and of its extensions, and the boxes of the prior that they fill."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from ..prior import Prior
from ..sobol import sobol
from .experiment import Extension

MIN_POSTERIOR_SDS = 10.0  # posterior sds: narrower boxes make slopes of noise (errors in variables)
FIRST_HALF_WIDTH = 0.25  # half a box's width to begin with
LATER_HALF_WIDTH = 0.08  # later; half as much in each further pass, down to what the sds allow
MAX_HALF_WIDTH = 0.5  # at most
WALL_SHARE = 0.02  # of a box's width, within which a point lies at its wall
PRIOR_END = 0.02  # quantiles from an end of a prior to neutral, within which it is one-sided


@dataclass(frozen=True, eq=False)
class Runs:
    """n successful simulations.

    Attributes:
        theta: Base parameters and the coefficients of all effects, name -> [n].
        neutral: Effect -> coefficient at which it does not act.
        signals: [n, *signal_shape].
        seeds: int64 [n].
        error: Of the first that failed; empty where none did.
    """

    theta: Mapping[str, np.ndarray]
    neutral: Mapping[str, float]
    signals: np.ndarray
    seeds: np.ndarray
    error: str = ""

    def __len__(self) -> int:
        return len(self.seeds)

    def of(self, names: tuple[str, ...]) -> "Runs":
        """Those in which no other effect than the named ones acts."""
        kept = np.ones(len(self), bool)
        for effect in self.neutral.keys() - set(names):
            kept &= self.theta[effect] == self.neutral[effect]
        theta = {name: column[kept] for name, column in self.theta.items()}
        return Runs(theta, self.neutral, self.signals[kept], self.seeds[kept])


def joined(parts: Sequence[Runs]) -> Runs:
    """All of them, in order."""
    names, neutral = parts[0].theta, parts[0].neutral
    return Runs(
        {name: np.concatenate([part.theta[name] for part in parts]) for name in names},
        neutral,
        np.concatenate([part.signals for part in parts]),
        np.concatenate([part.seeds for part in parts]),
        next((part.error for part in parts if part.error), ""),
    )


class PriorBox(NamedTuple):
    """low, high: prior quantiles [d]."""

    low: np.ndarray
    high: np.ndarray

    @classmethod
    def whole(cls, dimension: int) -> Self:
        """All prior quantiles."""
        return cls(np.zeros(dimension), np.ones(dimension))

    @classmethod
    def around(
        cls, centre: np.ndarray, sd: np.ndarray, least: float, most: float = MAX_HALF_WIDTH
    ) -> Self:
        """The box about a posterior, from `least` to `most` to each side.

        A missing effect displaces the base parameters by many of their sds, so the first box is
        wide.
        """
        half = np.clip(MIN_POSTERIOR_SDS * sd, least, most)
        return cls(np.maximum(centre - half, 0.0), np.minimum(centre + half, 1.0))

    def encloses(self, u: np.ndarray) -> bool:
        """Whether u [d] lies inside and at no wall but that of the prior.

        What is best at a wall of a box in which the search was held may be better beyond.
        """
        margin = WALL_SHARE * (self.high - self.low)
        low = np.where(self.low > 0.0, self.low + margin, self.low)
        high = np.where(self.high < 1.0, self.high - margin, self.high)
        return bool(np.all((u >= low) & (u <= high)))

    def hull(self, other: Self) -> Self:
        """The smallest box that holds both."""
        return type(self)(np.minimum(self.low, other.low), np.maximum(self.high, other.high))

    def intersection(self, other: Self) -> Self:
        """The box that both have in common."""
        return type(self)(np.maximum(self.low, other.low), np.minimum(self.high, other.high))

    def extended(self, count: int) -> Self:
        """With the priors of `count` coefficients, whose neutral values may be at an end."""
        return type(self)(
            np.append(self.low, np.zeros(count)), np.append(self.high, np.ones(count))
        )

    def fill(self, prior: Prior, seed: int, count: int) -> dict[str, np.ndarray]:
        """`count` points, spread evenly, in natural units, name -> [count]."""
        u = sobol(seed, 0, count, len(self.low))
        return prior.from_unit(self.low + (self.high - self.low) * u)


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
