"""Protocols of what the engine learns and how it chooses; families and users satisfy them.

A member with a body need not be written: a class that names the protocol as its base inherits it.
"""

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple, Protocol

import jax
import numpy as np
from numpy.typing import ArrayLike

from .._float64 import in_float64
from ..arguments import checked_array
from ..prior import Prior
from ..simulations.failures import Failure
from ..types import LogLikelihood, Theta
from .squared_difference import evaluate, sum_of_squares


class RunOutcomes(NamedTuple):
    """Runs so far."""

    u: np.ndarray  # [p, d]
    succeeded: np.ndarray  # bool [p]


class TrainingData(NamedTuple):
    """Successful simulations, as a family measured them."""

    observed: Any  # as `Family.view` returned it
    u: np.ndarray  # [n, d], prior quantiles
    features: np.ndarray  # [n, m]
    discrepancy: np.ndarray  # [n]
    runs: RunOutcomes  # all, failed ones too
    prior: Prior  # of which the quantiles are

    @property
    def tails(self) -> np.ndarray | None:
        """See `Prior.tails`."""
        return self.prior.tails


class Measured(NamedTuple):
    """n simulations in view of what was observed."""

    features: np.ndarray  # [n, m]
    discrepancy: np.ndarray  # [n], NaN where a run failed
    errors: list[Failure | None]  # [n], of the user's own function that compares signals


class Surrogate(Protocol):
    """A likelihood learned from simulations, over prior quantiles u in [0, 1]^d."""

    u: np.ndarray  # [n, d], where it was learned, fantasized points included
    log_likelihood: LogLikelihood

    @abstractmethod
    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new simulation at u [n, d], each [n, ...]."""

    @abstractmethod
    def fantasize(self, u: np.ndarray) -> "Surrogate":
        """The surrogate after its own predictions at u [n, d] came true (pending points)."""

    @abstractmethod
    def best(self) -> np.ndarray:
        """The u [d] that fits best."""

    def warnings(self, *, confirmed: bool = False) -> list[str]:
        """Warnings, in sentences.

        Args:
            confirmed: Runs at draws of the posterior left it where it was: then errors of the
                emulator, which may lie far from it, are not complained of.
        """
        return []

    @property
    def unreached(self) -> list[str]:
        """Sentences that say why nothing can be concluded from a table without a simulator."""
        return []

    @property
    def fits(self) -> bool:
        """Whether what was observed is explained."""
        return True

    @property
    def cautious(self) -> "Surrogate":
        """The surrogate to which its own doubt beyond what the data can resolve is no
        agreement."""
        return self

    @property
    def stated(self) -> "Surrogate":
        """The surrogate of the model as the user states it, without what guards against its being
        wrong."""
        return self

    @property
    def sure(self) -> LogLikelihood:
        """The log likelihood, were what is emulated known."""
        return self.log_likelihood

    def log_second_moment(self, u: np.ndarray, runs: np.ndarray | None = None) -> np.ndarray:
        """log E[L^2] [n] at u [n, d], L being known only through the surrogate; or the expectation
        of E[L | a run]^2 [n, m] before a run is made at each of `runs` [m, d]."""
        known = 2.0 * np.asarray(self.log_likelihood(u))
        return known if runs is None else np.repeat(known[:, None], len(runs), axis=1)

    def realisations(self, rng: np.random.Generator, u: np.ndarray, n: int) -> np.ndarray:
        """Log likelihoods [n, m] at different u [m, d], each row under one draw of what is
        emulated; NaN where that cannot be drawn."""
        return np.full((n, len(u)), np.nan)

    def log_success(self, u: np.ndarray) -> np.ndarray:
        """Log probability [n] that a run at u [n, d] succeeds."""
        return np.zeros(len(u))

    def predicted(self, features: np.ndarray, discrepancy: np.ndarray) -> np.ndarray:
        """The quantity of `predict`, for n finished runs [n, ...]."""
        return features

    def constants(self) -> dict[str, np.ndarray]:
        """Constants of the likelihood, kept with the posterior."""
        return {}

    def described(self) -> list[str]:
        """The most important constants, in a few words."""
        return []

    def checks(self) -> dict[str, np.ndarray]:
        """Checks of the emulator: `loo_z`, studentised leave-one-out errors [n, ...], a row for
        each simulation that was learned from."""
        return {}

    def predictive(self, rng: np.random.Generator, u: np.ndarray) -> dict[str, np.ndarray]:
        """One new observation for each row of u [n, d]: name -> [n, ...]."""
        return {}

    def placed(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """What holds for each number of `predict`, [n, ...], at the place of what was observed:
        name -> [n, ...]."""
        return {"predicted": values}

    @property
    def compared(self) -> dict[str, np.ndarray]:
        """What was made of the observed output, to be compared, where it is not the output itself:
        name, as of `pointwise` -> [...]."""
        return {}

    @property
    def log_constant(self) -> float:
        """What `log_likelihood` lacks to be the log density of what was observed."""
        return 0.0

    @property
    def log_variance(self) -> float:
        """Variance of the log likelihood, by what the surrogate counts as noise and is its own
        error, beyond that of `log_second_moment`."""
        return 0.0

    def pointwise(self, u: np.ndarray) -> dict[str, np.ndarray]:
        """Log density of each observed value, given all others, at u [n, d]: name -> [n, ...]. Here
        what was observed is one datum."""
        return {"observed": np.asarray(self.log_likelihood(u)) + self.log_constant}


class Family(Protocol):
    """How runs are compared with what was observed, and what is learned of them.

    Attributes:
        name: Kept with the results; if it is empty, the class name is kept.
        acquisition: Name of the rule that chooses where nobody says which.
        replicates: Whether some points are simulated twice, to show run-to-run noise.
        has_lower_bound: Whether its surrogates have the method `lower_bound(u, width)`, which "lcb"
            minimises: mean less `width` sds of what is least where the data are explained, [n].
    """

    name: ClassVar[str] = ""
    acquisition: ClassVar[str] = "draws"
    replicates: ClassVar[bool] = False
    has_lower_bound: ClassVar[bool] = False

    def learn(self, data: TrainingData, key: np.ndarray) -> Surrogate:
        """The surrogate on which a fit rests.

        Args:
            data: Of three simulations at least.
            key: Fixes what is random: a key of JAX as two words, uint32 [2], which
                `np.random.default_rng` takes as a seed, too.
        """
        ...

    def search(self, data: TrainingData, key: np.ndarray, previous: Any) -> Surrogate:
        """The surrogate to search with; `previous` was learned from the first of these data, or is
        None."""
        return self.learn(data, key)

    @property
    def any_shape(self) -> bool:
        """Whether signals may have another shape than what was observed."""
        return False

    def observe(self, observed: ArrayLike | None) -> np.ndarray:
        """The observed output, float64.

        Raises:
            ValueError: it is missing, or no numbers.
        """
        if observed is None:
            raise ValueError(
                "observed must be an array of numbers, got None; a simulator that returns the log "
                'likelihood needs surrogate="log_likelihood", losses need fit_losses'
            )
        array = checked_array("observed", observed)
        if np.isinf(array).any():
            raise ValueError("observed must not be infinite; NaN is a missing sample")
        return array

    def view(self, observed: np.ndarray) -> Any:
        """What the family makes of the observed output, once, for `measure` and `learn`.

        Raises:
            ValueError: it cannot be learned from.
        """
        return observed

    def check_prior(self, observed: Any, prior: Prior) -> None:
        """Raise ValueError where the family's own options do not suit the prior.

        Args:
            observed: As `view` returned it.
        """

    def measure(self, observed: Any, signals: Sequence[np.ndarray | None]) -> Measured:
        """Features and discrepancies of n signals, read-only and None where a run failed: here the
        values of each, and the sum of their squared differences to what was observed."""
        return Measured(flattened(observed, signals), *evaluate(sum_of_squares, observed, signals))


def flattened(observed: np.ndarray, signals: Sequence[np.ndarray | None]) -> np.ndarray:
    """The values of each signal [n, m]; NaN where one has another shape than what was observed."""
    features = np.full((len(signals), observed.size), np.nan)
    for row, signal in zip(features, signals, strict=True):
        if signal is not None and signal.shape == observed.shape:
            row[:] = signal.ravel()
    return features


class Acquisition(Protocol):
    """Where to simulate next."""

    def __call__(self, key: jax.Array, surrogate: Any, n: int, /) -> np.ndarray:
        """n different points u [n, d].

        Args:
            key: Fixes the choice.
            surrogate: A `Surrogate` to which pending points were added, see `fantasize`.
            n: Points wanted.
        """
        ...


class SurrogateView:
    """A surrogate in the prior's natural units.

    Attributes:
        prior: Leads from parameters to the quantiles that the surrogate knows.
        learned: The surrogate over these quantiles, with all that its family offers.
    """

    def __init__(self, prior: Prior, learned: Surrogate):
        self.prior = prior
        self.learned = learned

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.prior}, {type(self.learned).__name__})"

    @in_float64
    def predict(self, theta: Theta) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new simulation at theta, each [..., *its own axes].

        Of the discrepancy family that is the transformed discrepancy, of the signal family the
        output's values; the sd holds run-to-run noise, but no measurement noise.
        """
        u = self.prior.to_unit(theta)
        mean, sd = (
            np.reshape(part, (*u.shape[:-1], *np.shape(part)[1:]))
            for part in self.learned.predict(u.reshape(-1, u.shape[-1]))
        )
        return mean, sd
