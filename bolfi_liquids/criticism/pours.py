"""Outcomes of pours as an experiment that the engine can criticise."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..inputs.pour_table import PourTable
from ..seeds import Phase, simulation_seeds
from ..simulators import RATE, BatchOf, PourSimulator
from .pour_noise import PourNoise

if TYPE_CHECKING:
    from numpyro.distributions import Distribution

    from ..inference import Prior
    from ..inference.criticism import Experiment
    from ..models import Cups

MIN_PRIOR_SD = 0.05
"""Of the log of a log-uniform parameter, or as a share of another's prior interquartile range."""

OUTCOMES = ("spilled", "retained")


@dataclass(frozen=True)
class Fractions:
    """Spilled and retained fractions (B, 2, A) of liquids (B,), each pouring all actions.

    Each angular velocity of a run is poured once, with a packing of its own, which all of its
    distances share: they differ by the receiver alone.

    Attributes:
        angular_velocity, distance: Of each pour [rad/s], [m], shape (A,).
    """

    angular_velocity: NDArray[np.float64]
    distance: NDArray[np.float64]

    def __call__(
        self, batch: BatchOf, theta: Mapping[str, NDArray], seeds: NDArray
    ) -> NDArray[np.float64]:
        from .. import models

        rates, at = np.unique(self.angular_velocity, return_inverse=True)
        runs = len(seeds)
        each = {name: np.repeat(values, len(rates)) for name, values in theta.items()}
        own = [simulation_seeds(int(one), Phase.RUNS_OF_POURS, len(rates)) for one in seeds]
        pours = batch({**each, RATE: np.tile(rates, runs)}, np.ravel(own))
        landed = models.landings(*pours)
        rows = np.add.outer(len(rates) * np.arange(runs), at).ravel()
        result = models.Landings(landed.position[rows], landed.retained[rows]).into(
            np.tile(self.distance, runs), pours.cups.receiver.radius
        )
        outcomes = [np.asarray(getattr(result, name), np.float64) for name in OUTCOMES]
        return np.stack([outcome.reshape(runs, -1) for outcome in outcomes], axis=1)

    @property
    def settings(self) -> list[Any]:
        """The actions."""
        actions = [self.angular_velocity.tolist(), self.distance.tolist()]
        return [Phase.RUNS_OF_POURS.value, actions]


def pour_experiment(table: PourTable, cups: "Cups", density: float) -> "Experiment":
    """The pours of a table, each outcome a window of its own."""
    from ..inference.criticism import Experiment, Window

    pours = PourSimulator(cups, density, Fractions(table.angular_velocity, table.distance))
    every = np.ones(table.observed.shape, bool)
    windows = [
        Window({"outcome": name}, every & (np.arange(len(OUTCOMES)) == k)[:, None])
        for k, name in enumerate(OUTCOMES)
    ]
    return Experiment(
        pours.batched,
        table.observed,
        PourNoise(table.angular_velocity, table.distance),
        pours.identity,
        table.path.name,
        tuple(windows),
    )


def as_prior(theta: Mapping[str, NDArray], weights: NDArray, prior: "Prior") -> "Prior":
    """The posterior of stirring, as the prior of the next experiment.

    Each parameter by itself: log-normal where its prior is log-uniform, else normal within the
    prior's bounds. Their correlation after stirring is small.

    Args:
        theta: Points of the posterior, name -> (n,).
        weights: Theirs, shape (n,).
        prior: Of the same parameters before the stirring.
    """
    import numpyro.distributions as dist

    from ..inference import Prior

    def moments(values: NDArray) -> tuple[float, float]:
        mean = float(np.average(values, weights=weights))
        return mean, float(np.sqrt(np.average((values - mean) ** 2, weights=weights)))

    quantiles = prior.from_unit(np.array([0.0, 0.25, 0.75, 1.0])[:, None] * np.ones(len(prior)))

    def learned(name: str, before: "Distribution") -> "Distribution":
        if isinstance(before, dist.LogUniform):
            mean, sd = moments(np.log(theta[name]))
            return dist.LogNormal(mean, max(sd, MIN_PRIOR_SD))
        mean, sd = moments(theta[name])
        low, lower, upper, high = (float(quantile) for quantile in quantiles[name])
        return dist.TruncatedNormal(
            mean, max(sd, MIN_PRIOR_SD * (upper - lower)), low=low, high=high
        )

    return Prior({name: learned(name, before) for name, before in prior.distributions.items()})
