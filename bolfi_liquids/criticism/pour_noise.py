"""Difference between simulated and real pours when no effect is missing."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from numpy.random import Generator

REPEATABILITY_SD = 0.02
"""Standard deviation of a fraction when a real pour is repeated."""

SIMULATOR_ERROR_SD = 0.08, 0.04
"""Standard deviation of the simulator's error in the spilled and in the retained fraction."""

CORRELATION_LENGTH = 1.0, 6.0
"""Distance between actions, in `ACTION_STEP`, over which these errors are correlated."""

ACTION_STEP = 0.5, 0.007
"""Differences that count as distance 1: of the log of the angular velocity; of distances [m]."""


def action_coordinates(angular_velocity: NDArray, distance: NDArray) -> NDArray[np.float64]:
    """Actions [rad/s], [m] in `ACTION_STEP`, shape (n, 2)."""
    return np.column_stack([np.log(angular_velocity), distance]) / ACTION_STEP


@dataclass(frozen=True, eq=False)
class PourNoise:
    """Noise of the spilled and retained fractions of pours, correlated between like actions.

    Measured on the 19 pours of a volume-of-fluid solver in `tests/data/pour_reference`, each at 21
    distances: water, oil, glycerin and gel, at two contact angles. The simulator misplaces the
    stream by 3 mm, RMS, so its errors at neighbouring actions are alike. Cells of 4 and of 3.3 mm
    err by 0.074 and 0.081 of the liquid in what is spilled, by 0.039 and 0.024 in what is retained.

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
