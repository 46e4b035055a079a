"""Whether runs at draws of a posterior left it where it was."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .._lazy import stats
from .importance import LEAST

if TYPE_CHECKING:
    from ..history import History

ROUNDING = 1e-12
SURPRISE_ALPHA = 0.01  # chance that runs seem otherwise than predicted though they are not
MAX_SHIFT, MAX_SHIFT_BY_SURPRISE = 1.0, 0.05  # sds, see `Before.holds`
MIN_SHARE = 0.5  # of the runs at draws, that must come back, and of these, that must succeed


class Before(NamedTuple):
    """A posterior before runs were made at draws of it.

    Attributes:
        mean, sd: Of each parameter [d], in normal scores of the prior.
        learned: The `Surrogate` on which it rests.
        told: Simulations that were told.
        drawn: Draws of it that were asked next, theta [n, d].
        asked: Points that had been asked when the surrogate was learned.
    """

    mean: np.ndarray
    sd: np.ndarray
    learned: Any
    told: int
    drawn: np.ndarray
    asked: int = 0

    def runs(self, history: "History") -> np.ndarray:
        """Rows of the runs at the draws, whatever was told among them."""
        later = history.theta[self.told :]
        at_draws = (later[:, None] == self.drawn).all(-1).any(-1)
        return self.told + np.flatnonzero(at_draws)

    def holds(self, history: "History", mean: np.ndarray, sd: np.ndarray) -> bool | None:
        """Whether most runs succeeded, and the posterior that knows them is the same; None where
        most have not come back.

        It is where no mean moved by more than the smaller sd, and no sd grew or shrank to twice as
        much. Where the runs came out otherwise than predicted, the emulator is wrong in a part of
        the posterior, of which so few runs show little: then a twentieth of that is enough.

        Args:
            history: With the runs.
            mean, sd: Of the posterior that knows them.
        """
        runs = self.runs(history)
        if len(runs) < MIN_SHARE * len(self.drawn):
            return None
        good = runs[history.succeeded[runs]]
        if len(good) < MIN_SHARE * len(runs):
            return False
        share = MAX_SHIFT_BY_SURPRISE if self._surprised(history, good) else MAX_SHIFT
        near = np.abs(self.mean - mean) <= share * np.minimum(self.sd, sd)
        alike = np.maximum(self.sd, sd) < (1.0 + share) * np.minimum(self.sd, sd) + LEAST
        return bool(near.all() and alike.all())

    def _surprised(self, history: "History", runs: np.ndarray) -> bool:
        """Whether these runs' errors, studentised, are larger than chance explains.

        Those of one run, of however many values, count as one: they may hang together.
        """
        made = self.learned.predicted(history.features[runs], history.discrepancy[runs])
        mean, sd = self.learned.predict(history.u[runs])
        missed = np.abs(made - mean)
        missed = np.where(missed > ROUNDING * np.abs(mean), missed, 0.0)
        # what has been constant so far is predicted for sure
        errors = np.divide(missed, sd, out=np.where(missed > 0.0, np.inf, 0.0), where=sd > 0.0)
        known = len(self.learned.u)
        return bool(np.mean(errors**2) > stats.f.isf(SURPRISE_ALPHA, len(runs), known))
