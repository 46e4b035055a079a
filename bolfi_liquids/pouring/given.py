"""Pours that were made of the liquid, between a map of pours and the decision."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..criticism.pours import (
    CORRELATION_LENGTH,
    SIMULATOR_ERROR_SD,
    action_coordinates,
)
from ..inputs.pour_table import PourTable
from ..seeds import Phase, generator
from .residual import Residual, angle, expected_share, learn_residual, share
from .result import CONTRADICTION, ActionSummary, GivenPour, GivenSummary, Judged
from .spillage import Surface, normal_scores

SHOWN_GIVEN = 3
"""Given pours that are shown beside the choice: those most like it."""


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
        """What actions may be expected to spill.

        Args:
            there: What the map says of them.
            here: What it says of the given pours, for the same draws, shape (draws, A).
        """
        at = action_coordinates(
            np.repeat(there.angular_velocity, len(there.distance)),
            np.tile(there.distance, len(there.angular_velocity)),
        )
        flat = there.spilled.reshape(len(there.spilled), -1)
        moved = self.spilled.moved(angle(here), angle(flat), at)
        return there._replace(spilled=expected_share(*moved).reshape(there.spilled.shape))

    def outcomes(self, there: Judged, here: NDArray, seed: int) -> Judged:
        """What becomes of the liquid in the n outcomes of an action.

        Args:
            there: What the map says of them.
            here: Spilled and retained fractions of the given pours in the same outcomes, shape
                (n, A, 2).
            seed: Of how far each outcome is from what is expected of it.
        """
        rng, at = generator(seed, Phase.GIVEN_POURS), _coordinates_of(there)
        scores = normal_scores(len(there.fractions))
        fractions = []
        for k, (residual, column) in enumerate(((self.spilled, 0), (self.retained, 2))):
            mean, sd = residual.moved(angle(here[..., k]), angle(there.fractions[:, [column]]), at)
            fractions.append(share(mean[:, 0] + sd * rng.permutation(scores)))
        spilled, retained = fractions
        received = np.maximum(1.0 - spilled - retained, 0.0)
        whole = np.column_stack([spilled, received, retained])
        return replace(there, fractions=whole / whole.sum(axis=1, keepdims=True))

    def nearest(self, chosen: Judged) -> NDArray[np.int64]:
        """The given pours by how like an action they are, the likest first, shape (A,)."""
        apart = np.sum((self.spilled.at - _coordinates_of(chosen)) ** 2, axis=1)
        return np.argsort(apart, kind="stable")

    def summary(self, chosen: Judged, without: Judged) -> GivenSummary:
        """Numbers of the given pours, of the chosen action, and of that without given pours."""
        table = self.table
        numbers = zip(
            table.lines.tolist(),
            np.degrees(table.angular_velocity).tolist(),
            (100.0 * table.distance).tolist(),
            *table.observed.tolist(),
            *self.expected.T.tolist(),
            strict=True,
        )
        pours = [GivenPour(*row) for row in numbers]
        worst = max(pours, key=lambda pour: pour.contradiction)
        return GivenSummary(
            file=table.path.name,
            sha256=table.hash,
            liquid=table.liquid,
            lines=tuple(pour.line for pour in pours),
            nearest=tuple(pours[k] for k in self.nearest(chosen)[:SHOWN_GIVEN]),
            contradicting=worst if worst.contradiction >= CONTRADICTION else None,
            without=ActionSummary.of(without),
        )


def _coordinates_of(judged: Judged) -> NDArray[np.float64]:
    """Shape (1, 2)."""
    return action_coordinates(np.array([judged.angular_velocity]), np.array([judged.distance]))


def learn_given(table: PourTable, spilled: NDArray, retained: NDArray) -> GivenPours:
    """Learn what a map misses of given pours.

    Args:
        table: The pours that count, A of them.
        spilled, retained: Fractions that the map predicts of each, for draws of the liquid, shape
            (draws, A).
    """
    at = action_coordinates(table.angular_velocity, table.distance)
    kinds = zip(
        table.observed, (spilled, retained), SIMULATOR_ERROR_SD, CORRELATION_LENGTH, strict=True
    )
    learned = [
        learn_residual(at, angle(seen), angle(here), sd, (length, length))
        for seen, here, sd, length in kinds
    ]
    expected = np.column_stack([spilled.mean(axis=0), retained.mean(axis=0)])
    return GivenPours(table, expected, *learned)
