"""Pours as experiments that the engine can criticise: outcomes, noise, prior and proposals."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..inputs.pour_table import PourTable
from ..seeds import Phase, simulation_seeds
from ..simulators import RATE, BatchOf, PourSimulator

if TYPE_CHECKING:
    from numpy.random import Generator
    from numpyro.distributions import Distribution

    from ..inference import Prior
    from ..inference.criticism import Experiment, Proposal
    from ..models import Cups

OUTCOMES = ("spilled", "retained")

REPEATABILITY_SD = 0.02
"""Standard deviation of a fraction when a real pour is repeated."""

SIMULATOR_ERROR_SD = 0.07, 0.02
"""Standard deviation of the simulator's error in the spilled and in the retained fraction."""

CORRELATION_LENGTH = 1.0, 6.0
"""Distance between actions, in `ACTION_STEP`, over which these errors are correlated."""

ACTION_STEP = 0.5, 0.007
"""Differences that count as distance 1: of the log of the angular velocity; of distances [m]."""

MIN_PRIOR_SD = 0.05
"""Of the log of a log-uniform parameter, or as a share of another's prior interquartile range."""

PROPOSED_RATES = 2
"""Angular velocities of proposed pours: the slowest one and those up to the middle."""


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

    @property
    def noise(self) -> "PourNoise":
        """Noise of these pours."""
        return PourNoise(self.angular_velocity, self.distance)

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


def action_coordinates(angular_velocity: NDArray, distance: NDArray) -> NDArray[np.float64]:
    """Actions [rad/s], [m] in `ACTION_STEP`, shape (n, 2)."""
    return np.column_stack([np.log(angular_velocity), distance]) / ACTION_STEP


@dataclass(frozen=True, eq=False)
class PourNoise:
    """Noise of the spilled and retained fractions of pours, correlated between like actions.

    Measured on the 19 pours of a volume-of-fluid solver in `tests/data/pour_reference`, each at 21
    or 10 distances: water, oil, glycerin and gel, at two contact angles. The simulator misplaces
    the stream by 3 mm, RMS, so its errors at neighbouring actions are alike. Cells of 4 and of
    3.3 mm err by 0.070 and 0.073 of the liquid in what is spilled, and by 0.021 and 0.013 in what
    is retained of glycerin and gel.

    Attributes:
        angular_velocity, distance: Of each pour [rad/s], [m], shape (A,).
    """

    angular_velocity: NDArray[np.float64]
    distance: NDArray[np.float64]

    def covariance(self, at) -> NDArray[np.float64]:
        """[n, n] of n fractions; `at` holds each one's pour (channel) and outcome (sample)."""
        actions = action_coordinates(self.angular_velocity, self.distance)
        apart = np.sum((actions[at.channel, None] - actions[at.channel]) ** 2, axis=-1)
        sd, length = np.array([SIMULATOR_ERROR_SD, CORRELATION_LENGTH])[:, at.sample]
        missed = np.exp(-0.5 * apart / np.outer(length, length)) * np.outer(sd, sd)
        same = np.equal.outer(at.sample, at.sample)
        return missed * same + REPEATABILITY_SD**2 * np.eye(len(at.sample))

    def draw(self, rng: "Generator", at, count: int) -> NDArray[np.float64]:
        """[count, n]."""
        zero = np.zeros(len(at.sample))
        return rng.multivariate_normal(zero, self.covariance(at), count, method="cholesky")


def pour_experiment(table: PourTable, cups: "Cups", density: float) -> "Experiment":
    """The pours of a table, each outcome a window of its own."""
    from ..inference.criticism import Experiment, Window

    actions = Fractions(table.angular_velocity, table.distance)
    pours = PourSimulator(cups, density, actions)
    every = np.ones(table.observed.shape, bool)
    windows = [
        Window({"outcome": name}, every & (np.arange(len(OUTCOMES)) == k)[:, None])
        for k, name in enumerate(OUTCOMES)
    ]
    return Experiment(
        pours.batched,
        table.observed,
        actions.noise,
        pours.identity_with_effects,
        table.path.name,
        tuple(windows),
    )


def pour_proposals(cups: "Cups", density: float) -> list["Proposal"]:
    """Pours at the slowest and at middling angular velocities, from two distances each."""
    from ..inference.criticism import Proposal

    rates = np.linspace(*cups.angular_velocity_range, PROPOSED_RATES + 1)[:-1]
    distance = np.linspace(*cups.distance_range, 4)[1:3]
    apart = " and ".join(f"{100 * one:.1f}" for one in distance)
    shape, made = (len(OUTCOMES), len(distance)), []
    for rate in rates:
        actions = Fractions(np.full(len(distance), rate), distance)
        pours = PourSimulator(cups, density, actions)
        label = f"pours at {np.degrees(rate):.0f} deg/s from {apart} cm"
        turning = cups.pour.final_angle / float(rate)
        identity = pours.identity_with_effects
        made.append(Proposal(pours.batched, actions.noise, shape, identity, label, turning))
    return made


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
