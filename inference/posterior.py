"""What a run concludes: posterior, best hypothesis, surrogate, simulations."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from scipy.special import ndtr

from ._float64 import in_float64
from .base import Theta
from .discrepancy_surrogate import DiscrepancySurrogate
from .ensemble import sample_emcee
from .nuts import Length, sample_nuts
from .prior import Prior
from .results import posterior_tree, simulations_dataset
from .state import History
from .target import log_likelihoods

SAMPLERS = {"nuts": sample_nuts, "emcee": sample_emcee}


class Closest(NamedTuple):
    """The simulation that came nearest to what was observed."""

    theta: dict[str, float]
    signal: np.ndarray
    discrepancy: float


class SurrogateView(NamedTuple):
    """The surrogate in the prior's natural units."""

    prior: Prior
    learned: DiscrepancySurrogate

    @property
    def transform(self) -> str:
        """Name of g."""
        return self.learned.transform.name

    @property
    def threshold(self) -> float:
        """eps, on the scale of g(Delta)."""
        return self.learned.threshold

    def predict(self, theta: Theta) -> tuple[np.ndarray, np.ndarray]:
        """Mean and sd, noise included, of a new g(Delta) at theta: each [...]."""
        u = self.prior.to_unit(theta)
        mean, sd = self.learned.predict(u.reshape(-1, u.shape[-1]))
        return mean.reshape(u.shape[:-1]), sd.reshape(u.shape[:-1])


@dataclass(frozen=True)
class Fit:
    """Result of `fit` or `Bolfi.fit`; immutable.

    Attributes:
        prior, observed: As given.
        history: Every simulation, in the order told.
        learned: The surrogate over prior quantiles.
        settings: How the run was made.
        seconds: Time in the "simulator" and in the "engine" [s].
    """

    prior: Prior
    observed: np.ndarray
    history: History
    learned: DiscrepancySurrogate
    settings: Mapping[str, object]
    seconds: Mapping[str, float]

    @property
    def surrogate(self) -> SurrogateView:
        return SurrogateView(self.prior, self.learned)

    @property
    def best(self) -> dict[str, float]:
        """Minimiser of the surrogate's mean over the prior's box (paper's theta*)."""
        return {n: float(v) for n, v in self.prior.from_unit(self.learned.minimum()).items()}

    @property
    def closest(self) -> Closest:
        """The simulated hypothesis of least discrepancy."""
        i = int(np.nanargmin(self.history.discrepancy))
        theta = {n: float(v) for n, v in self.prior.to_dict(self.history.theta[i]).items()}
        return Closest(theta, self.history.signals[i], float(self.history.discrepancy[i]))

    @property
    def simulations(self) -> xr.Dataset:
        """Every simulation in the order told: theta, seed, round, discrepancy, failed, error,
        signal."""
        return simulations_dataset(self.prior, self.history)

    @property
    def failures(self) -> dict[str, int]:
        """How many simulations failed, by kind: "raised", "not finite", "timeout"."""
        return self.history.failures

    @in_float64
    def log_prob(self, theta: Theta) -> np.ndarray:
        """Unnormalised log posterior density in natural units, [...]; -inf off the support."""
        u = self.prior.to_unit(theta)
        flat = jnp.asarray(u.reshape(-1, u.shape[-1]))
        log_l = log_likelihoods(self.learned.log_likelihood, self.learned.state, flat)
        return self.prior.log_prob(theta) + np.asarray(log_l).reshape(u.shape[:-1])

    @in_float64
    def sample(
        self,
        sampler: str = "nuts",
        *,
        chains: int = 4,
        draws: int = 1000,
        warmup: int = 500,
        seed: int = 0,
    ) -> xr.DataTree:
        """Draw from the posterior.

        Args:
            sampler: "nuts" or "emcee".
            chains: Independent chains, at least 2, for R-hat needs them.
            draws: Kept per chain, at least 4.
            warmup: Discarded steps per chain that adapt the sampler.
            seed: Fixes the draws.

        Returns:
            DataTree in ArviZ's schema: posterior, sample_stats, prior, observed_data,
            constant_data, and `simulations`. Attributes of the posterior hold R-hat, ESS and
            divergences, those of the root how the run was made.

        Raises:
            ValueError: unknown sampler, or a length too small.
        """
        if sampler not in SAMPLERS:
            raise ValueError(f"sampler must be one of {tuple(SAMPLERS)}, got {sampler!r}")
        if chains < 2 or draws < 4 or warmup < 1:
            raise ValueError(
                "sampling needs chains >= 2, draws >= 4 and warmup >= 1, "
                f"got chains={chains}, draws={draws}, warmup={warmup}"
            )
        started = time.perf_counter()
        key, prior_key = jax.random.split(jax.random.key(seed))
        length = Length(chains, warmup, draws)
        made = SAMPLERS[sampler](
            key, self.learned.log_likelihood, self.learned.state, len(self.prior), length
        )
        groups = {
            "posterior": self.prior.from_unit(ndtr(made.x)),
            "sample_stats": made.stats,
            "prior": {n: v[None] for n, v in self.prior.sample(prior_key, draws).items()},
            "observed_data": {"signal": self.observed},
            "constant_data": {"threshold": np.asarray(self.learned.threshold)},
        }
        seconds = {**self.seconds, "sampling": time.perf_counter() - started}
        attributes = {
            **self.settings,
            **{"sampler": sampler, **length._asdict(), "sampling_seed": seed},
            **{f"seconds_{part}": spent for part, spent in seconds.items()},
        }
        return posterior_tree(groups, self.simulations, attributes)
