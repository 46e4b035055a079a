"""Protocols of what the engine learns and how it chooses; families and users satisfy them."""

from typing import Any, NamedTuple, Protocol

import jax
import numpy as np

from .._float64 import in_float64
from ..gp.process import GP
from ..prior import Prior
from ..simulations.failures import Failure
from ..types import LogLikelihood, LogSecondMoment, Theta
from .success import RunOutcomes


class TrainingData(NamedTuple):
    """Successful simulations, as a family measured them."""

    u: np.ndarray  # [n, d]
    features: np.ndarray  # [n, m]
    discrepancy: np.ndarray  # [n]
    normal: np.ndarray | None  # bool [d], see `Prior.normal`
    runs: RunOutcomes  # all, failed ones too


class Measured(NamedTuple):
    """n simulations in view of what was observed."""

    features: np.ndarray  # [n, m]
    discrepancy: np.ndarray  # [n], NaN where a run failed
    errors: list[Failure | None]  # [n], of the user's own function that compares signals


class Surrogate(Protocol):
    """A likelihood learned from simulations, over prior quantiles u in [0, 1]^d."""

    @property
    def gp(self) -> GP:
        """The processes on which it rests."""
        ...

    @property
    def state(self) -> Any:
        """NamedTuple of NumPy arrays on which the likelihood depends, `gp` among them; data, never
        a closure. NUTS is compiled for each set of shapes, see `nuts.padded_state`."""
        ...

    @property
    def success(self) -> GP | None:
        """Where runs succeed, see `success.log_success`; None is everywhere."""
        ...

    @property
    def cautious(self) -> "Surrogate":
        """The surrogate to which its own doubt beyond what the data can resolve is no
        agreement."""
        ...

    @property
    def sure(self) -> Any:
        """The state, were what is emulated known."""
        ...

    @property
    def log_likelihood(self) -> LogLikelihood: ...

    @property
    def log_second_moment(self) -> LogSecondMoment: ...

    def minimum(self) -> np.ndarray:
        """The u [d] that fits best."""
        ...

    def fantasize(self, u: np.ndarray) -> "Surrogate":
        """The surrogate after its own predictions at u [n, d] came true (pending points)."""
        ...

    def predict(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd of a new simulation at u [n, d], each [n, ...]."""
        ...

    def predicted(self, features: np.ndarray, discrepancy: np.ndarray) -> np.ndarray:
        """The quantity of `predict`, for n finished runs [n, ...]."""
        ...

    def constants(self) -> dict[str, np.ndarray]:
        """Constants of the likelihood, kept with the posterior."""
        ...

    def described(self) -> list[str]:
        """The most important constants, in a few words."""
        ...

    def checks(self) -> dict[str, np.ndarray]:
        """Of the emulator: `loo_z`, studentised leave-one-out errors [n, ...], a row for each
        simulation that was learned from."""
        ...

    @property
    def fits(self) -> bool:
        """Whether what was observed is explained."""
        ...

    def warnings(self, *, confirmed: bool = False) -> list[str]:
        """Warnings, in sentences.

        Args:
            confirmed: Runs at draws of the posterior left it where it was: then errors of the
                emulator, which may lie far from it, are not complained of.
        """
        ...

    def predictive(self, rng: np.random.Generator, u: np.ndarray) -> dict[str, np.ndarray]:
        """One new observation for each row of u [n, d]: name -> [n, ...]."""
        ...


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
        mean, sd = self.learned.predict(u.reshape(-1, u.shape[-1]))
        return _shaped(mean, u.shape[:-1]), _shaped(sd, u.shape[:-1])

    @property
    @in_float64
    def warnings(self) -> list[str]:
        """Warnings of the surrogate's own checks, in sentences."""
        return self.learned.warnings()


def _shaped(rows: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """[n, ...] -> [*shape, ...]."""
    return np.reshape(rows, (*shape, *np.shape(rows)[1:]))
