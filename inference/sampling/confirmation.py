"""Whether runs at draws of a posterior left it where it was."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .._lazy import stats

if TYPE_CHECKING:
    from ..history import History
    from ..surrogates.base import Surrogate

LEAST = 1e-12  # sd of a posterior that is one point
CHANCE = 0.01  # that runs seem otherwise than predicted though they are not
MOVED, MOVED_BY_SURPRISE = 1.0, 0.05  # sds by which a posterior may move, see `Before.holds`
MOST = 0.5  # of the runs, that must succeed


class Before(NamedTuple):
    """A posterior before runs were made at draws of it.

    Attributes:
        mean, sd: Of each parameter [d], in normal scores of the prior.
        learned: The surrogate on which it rests.
        told: Simulations that were told.
        drawn: Draws of it that were asked next.
    """

    mean: np.ndarray
    sd: np.ndarray
    learned: "Surrogate"
    told: int
    drawn: int

    @property
    def runs(self) -> slice:
        """Rows of the runs at the draws."""
        return slice(self.told, self.told + self.drawn)

    def holds(self, history: "History", mean: np.ndarray, sd: np.ndarray) -> bool:
        """Whether most runs succeeded, and the posterior that knows them is the same.

        It is where no mean moved by more than the smaller sd, and no sd grew or shrank to twice as
        much. Where the runs came out otherwise than predicted, the emulator is wrong in a part of
        the posterior, of which so few runs show little: then a twentieth of that is enough.

        Args:
            history: With the runs.
            mean, sd: Of the posterior that knows them.
        """
        good = self.told + np.flatnonzero(history.succeeded[self.runs])
        if len(good) < MOST * len(history.theta[self.runs]):
            return False
        share = MOVED_BY_SURPRISE if self._surprised(history, good) else MOVED
        near = np.abs(self.mean - mean) <= share * np.minimum(self.sd, sd)
        alike = np.maximum(self.sd, sd) < (1.0 + share) * np.minimum(self.sd, sd) + LEAST
        return bool(near.all() and alike.all())

    def _surprised(self, history: "History", runs: np.ndarray) -> bool:
        """Whether these runs' errors, studentised, are larger than chance explains.

        Those of one run, of however many values, count as one: they may hang together.
        """
        made = self.learned.predicted(history.features[runs], history.discrepancy[runs])
        mean, sd = self.learned.predict(history.u[runs])
        errors = np.divide(made - mean, sd, out=np.zeros_like(mean), where=sd > 0.0)
        known = len(self.learned.gp.data.u)
        return bool(np.mean(errors**2) > stats.f.isf(CHANCE, len(runs), known))
