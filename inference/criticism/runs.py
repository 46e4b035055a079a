"""Simulations of a model and of its extensions, in one table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Runs:
    """n successful simulations; none where all that were asked for failed.

    Attributes:
        theta: Base parameters and the coefficients of all effects, name -> [n].
        neutral: Effect -> coefficient at which it does not act.
        signals: [n, *signal_shape].
        seeds: int64 [n].
        error: Why there are none.
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
    )
