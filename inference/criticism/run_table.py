"""Simulations of a model and of its extensions, in one table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Runs:
    """n successful simulations.

    Attributes:
        theta: Base parameters and the coefficients of all e effects, name -> [n].
        acting: Which of the effects acted, bool [n, e].
        signals: [n, *signal_shape].
        seeds: int64 [n].
        effects: Names of the e effects.
    """

    theta: Mapping[str, np.ndarray]
    acting: np.ndarray
    signals: np.ndarray
    seeds: np.ndarray
    effects: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.seeds)

    def rows(self, which: np.ndarray) -> "Runs":
        """Those that `which` picks."""
        theta = {name: column[which] for name, column in self.theta.items()}
        return Runs(theta, self.acting[which], self.signals[which], self.seeds[which], self.effects)

    def of(self, names: tuple[str, ...]) -> "Runs":
        """Those in which no other effect than the named ones acts."""
        others = [k for k, effect in enumerate(self.effects) if effect not in names]
        return self.rows(self.acting[:, others].sum(axis=1) == 0)


def joined(parts: Sequence[Runs]) -> Runs:
    """All of them, in order."""
    first = parts[0]
    return Runs(
        {name: np.concatenate([part.theta[name] for part in parts]) for name in first.theta},
        np.concatenate([part.acting for part in parts]),
        np.concatenate([part.signals for part in parts]),
        np.concatenate([part.seeds for part in parts]),
        first.effects,
    )
