"""Expected spillage of a pour over liquids that might be in the cup."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .prior import split_parameters

if TYPE_CHECKING:
    from .models import Cups

FRACTIONS = ("spilled", "received", "retained")
ACTION = ("angular_velocity", "distance")
TAIL = 0.1  # share of the draws that CVaR averages


def mean_spillage(fractions: NDArray) -> float:
    """Mean spilled fraction of an action's outcomes, shape (draws, 3)."""
    return float(fractions[:, 0].mean())


def tail_spillage(fractions: NDArray) -> float:
    """Mean spilled fraction of the worst tenth of the outcomes (CVaR at 0.9), (draws, 3)."""
    worst = int(np.ceil(TAIL * len(fractions)))
    return float(np.sort(fractions[:, 0])[-worst:].mean())


RISK: dict[str, Callable[[NDArray], float]] = {"mean": mean_spillage, "cvar": tail_spillage}
"""What is minimised, by the name users give."""


@dataclass(frozen=True)
class Outcomes:
    """The liquids and seeds that every action is tried on.

    Actions that meet the same liquids and the same seeds (common random numbers) differ by
    what they are and not by luck.

    Attributes:
        theta: Parameter of the liquid, or coefficient of an effect -> values, shape (draws,).
        density: Of the liquid [kg/m3].
        cups: Source, receiver and how the source is turned.
        seeds: One for each draw, shape (draws,).
    """

    theta: Mapping[str, NDArray]
    density: float
    cups: "Cups"
    seeds: NDArray[np.int64]

    def simulate(self, action: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """Fractions (actions, draws, 3) spilled, received and retained.

        Args:
            action: `angular_velocity` [rad/s] and `distance` [m], shapes (actions,).
            seeds: The engine's, not used: see the class.
        """
        from . import models

        draws, actions = len(self.seeds), len(seeds)
        tiled = {name: np.tile(values, actions) for name, values in self.theta.items()}
        liquid, effects = split_parameters(tiled)
        turned = {name: np.repeat(action[name], draws) for name in ACTION}
        result = models.pour(
            models.Liquid(**liquid, density=self.density),
            models.PourAction(**turned),
            self.cups,
            np.tile(self.seeds, actions),
            effects=effects,
        )
        columns = [np.asarray(getattr(result, name), np.float64) for name in FRACTIONS]
        return np.stack(columns, axis=-1).reshape(actions, draws, len(FRACTIONS))

    @property
    def identity(self) -> str:
        """A text that two equal experiments share."""
        liquids = {name: np.asarray(values).tolist() for name, values in self.theta.items()}
        return json.dumps(
            [self.cups.settings(), self.density, liquids, np.asarray(self.seeds).tolist()],
            sort_keys=True,
        )
