"""Pours that were made of the liquid: a Gaussian process of what a map of landings misses of them.

A share s is an angle arcsin √s here: so a pour that is repeated varies alike whatever it spills,
and no correction leads below nothing or beyond all. What becomes of the liquid is the angle that
one of many outcomes of the map predicts, plus a process of the action that is the same for all
outcomes; a given pour is that plus its own repeatability. Given pours move each outcome by
Matheron's rule (Wilson et al., Pathwise conditioning of Gaussian processes, JMLR 2021): by what
separates this very outcome from them, as far as the process or the spread of the outcomes connects
them with the action.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..criticism.pours import (
    CORRELATION_LENGTH,
    REPEATABILITY_SD,
    SIMULATOR_ERROR_SD,
    action_coordinates,
)
from ..inputs.pour_table import PourTable
from ..seeds import Phase, generator
from .spillage import Judged, Surface, normal_scores

LOG_PRIOR_SD = 1.0, 0.5, 0.5
"""Of the logs of the process's standard deviation and of its two lengths."""
NODES = 7  # at which an expectation over the process is computed


def angle(share: NDArray) -> NDArray[np.float64]:
    """Angles of shares."""
    return np.arcsin(np.sqrt(np.clip(share, 0.0, 1.0)))


def share(angle: NDArray) -> NDArray[np.float64]:
    """Shares of angles; an angle beyond its ends counts as nothing or all."""
    return np.sin(np.clip(angle, 0.0, np.pi / 2.0)) ** 2


def expected_share(mean: NDArray, sd: NDArray) -> NDArray[np.float64]:
    """Mean share of angles that are normally distributed, mean (n, m) and sd (m,)."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
    parts = (w * share(mean + at * sd) for at, w in zip(nodes, weights, strict=True))
    return sum(parts, start=np.zeros_like(mean)) / weights.sum()


class Residual(NamedTuple):
    """Residual of one share that was observed in A given pours; see `learn_residual`.

    Attributes:
        at: `action_coordinates` of the given pours, shape (A, 2).
        observed: Angles of their shares, shape (A,).
        sd: Of the process.
        lengths: Of its correlation along both coordinates, shape (2,).
    """

    at: NDArray[np.float64]
    observed: NDArray[np.float64]
    sd: float
    lengths: NDArray[np.float64]

    def moved(
        self, here: NDArray, there: NDArray, at: NDArray
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Move predictions of n outcomes for m actions by the given pours.

        Args:
            here: Angles that the outcomes predict of the given pours, shape (n, A).
            there: Angles that they predict of the actions, shape (n, m).
            at: `action_coordinates` of the actions, shape (m, 2).

        Returns:
            Mean angles, shape (n, m), none beyond nothing or all; the sd of a pour about each,
            shape (m,).
        """
        cross = self.covariance(at, self.at)
        process = self.given_covariance
        weights = np.linalg.solve(process + _spread(here, here), (cross + _spread(there, here)).T).T
        left = self.sd**2 - 2.0 * np.sum(weights * cross, axis=1)
        left += np.sum((weights @ process) * weights, axis=1) + REPEATABILITY_SD**2
        # what lies below nothing for a smooth process is not known to be nothing
        mean = np.clip(there + (self.observed - here) @ weights.T, 0.0, np.pi / 2.0)
        return mean, np.sqrt(left)

    @property
    def given_covariance(self) -> NDArray[np.float64]:
        """Covariance of the given pours about an outcome, shape (A, A)."""
        return self.covariance(self.at, self.at) + REPEATABILITY_SD**2 * np.eye(len(self.at))

    def covariance(self, a: NDArray, b: NDArray) -> NDArray[np.float64]:
        """Covariance of the process between coordinates (n, 2) and (m, 2), shape (n, m)."""
        apart = np.sum(((a[:, None] - b) / self.lengths) ** 2, axis=-1)
        return self.sd**2 * np.exp(-0.5 * apart)

    def log_density(self, here: NDArray) -> float:
        """Log density of the given pours, for which outcomes predict angles `here` (n, A), less a
        constant."""
        whole = self.given_covariance + _spread(here, here)
        left = self.observed - here.mean(axis=0)
        return -0.5 * float(left @ np.linalg.solve(whole, left) + np.linalg.slogdet(whole)[1])


def _spread(a: NDArray, b: NDArray) -> NDArray[np.float64]:
    """Covariance (m, k) between outcomes a (n, m) and b (n, k)."""
    return (a - a.mean(axis=0)).T @ (b - b.mean(axis=0)) / len(a)


def learn_residual(
    at: NDArray, observed: NDArray, here: NDArray, sd: float, lengths: Sequence[float]
) -> Residual:
    """The process that most probably separates outcomes from given pours.

    Args:
        at: `action_coordinates` of the given pours, shape (A, 2).
        observed: Angles of their shares, shape (A,).
        here: Angles that n outcomes predict of them, shape (n, A).
        sd, lengths: Medians of the process's prior.
    """
    from scipy.optimize import minimize

    middle, width = np.log([sd, *lengths]), np.array(LOG_PRIOR_SD)

    def residual(z: NDArray) -> Residual:
        first, *others = np.exp(middle + width * z)
        return Residual(at, observed, float(first), np.array(others))

    def loss(z: NDArray) -> float:
        return 0.5 * float(z @ z) - residual(z).log_density(here)

    return residual(minimize(loss, np.zeros(len(middle)), method="L-BFGS-B").x)


@dataclass(frozen=True, eq=False)
class GivenPours:
    """Pours of the liquid, and the processes of what a map misses of them; see `learn_given`.

    Attributes:
        table: Those that count.
        expected: Spilled and retained fractions that the map alone expects of them, shape (A, 2).
        spilled, retained: Processes of the two fractions.
    """

    table: PourTable
    expected: NDArray[np.float64]
    spilled: Residual
    retained: Residual

    def surface(self, there: Surface, here: NDArray) -> Surface:
        """Expected spillage of actions.

        Args:
            there: What the map says of them.
            here: What it says of the given pours, for the same draws, shape (draws, A).
        """
        rates, distances = np.meshgrid(there.angular_velocity, there.distance, indexing="ij")
        at = action_coordinates(rates.ravel(), distances.ravel())
        flat = there.spilled.reshape(len(there.spilled), -1)
        moved = self.spilled.moved(angle(here), angle(flat), at)
        return there._replace(spilled=expected_share(*moved).reshape(there.spilled.shape))

    def outcomes(self, there: Judged, here: NDArray, seed: int) -> Judged:
        """Correct the n outcomes of an action.

        Args:
            there: What the map says of them.
            here: Spilled and retained fractions of the given pours in the same outcomes, shape
                (n, A, 2).
            seed: Of how far each outcome is from what is expected of it.
        """
        rng, at = generator(seed, Phase.GIVEN_POURS), _coordinates_of(there)
        scores = normal_scores(len(there.fractions))

        def moved(residual: Residual, here: NDArray, there: NDArray) -> NDArray[np.float64]:
            mean, sd = residual.moved(angle(here), angle(there[:, None]), at)
            return share(mean[:, 0] + sd * rng.permutation(scores))

        spilled = moved(self.spilled, here[..., 0], there.fractions[:, 0])
        retained = moved(self.retained, here[..., 1], there.fractions[:, 2])
        received = np.maximum(1.0 - spilled - retained, 0.0)
        whole = np.column_stack([spilled, received, retained])
        return replace(there, fractions=whole / whole.sum(axis=1, keepdims=True))

    def nearest(self, chosen: Judged) -> NDArray[np.int64]:
        """The given pours by how like an action they are, the likest first, shape (A,)."""
        apart = np.sum((self.spilled.at - _coordinates_of(chosen)) ** 2, axis=1)
        return np.argsort(apart, kind="stable")


def _coordinates_of(judged: Judged) -> NDArray[np.float64]:
    """Shape (1, 2)."""
    return action_coordinates(np.array([judged.angular_velocity]), np.array([judged.distance]))


def learn_given(table: PourTable, here: tuple[NDArray, NDArray]) -> GivenPours:
    """Learn what a map misses of given pours.

    Args:
        table: The pours that count, A of them.
        here: Spilled and retained fractions that the map predicts of each, for draws of the liquid,
            shape (draws, A).
    """
    at = action_coordinates(table.angular_velocity, table.distance)
    kinds = zip(table.observed, here, SIMULATOR_ERROR_SD, CORRELATION_LENGTH, strict=True)
    learned = [
        learn_residual(at, angle(seen), angle(predicted), sd, (length, length))
        for seen, predicted, sd, length in kinds
    ]
    expected = np.column_stack([predicted.mean(axis=0) for predicted in here])
    return GivenPours(table, expected, *learned)
