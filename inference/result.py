"""What a run concludes: posterior, best hypothesis, surrogate, simulations."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import jax
import numpy as np
import xarray as xr

from ._float64 import in_float64
from .history import History
from .prior import Prior
from .sampling.draw import SAMPLERS, draw_posterior
from .sampling.target import Length, Target, log_likelihood
from .surrogates.base import Surrogate
from .tree import (
    add_surrogate,
    finished,
    results_tree,
    simulations_dataset,
)
from .types import Theta


class Closest(NamedTuple):
    """The simulation that came nearest to what was observed."""

    theta: dict[str, float]
    signal: np.ndarray
    discrepancy: float


class SurrogateView:
    """The surrogate in the prior's natural units; other attributes are the surrogate's own."""

    def __init__(self, prior: Prior, learned: Surrogate):
        self.prior = prior
        self.learned = learned

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in ("prior", "learned"):  # while copied or unpickled
            raise AttributeError(name)
        return getattr(self.learned, name)

    def predict(self, theta: Theta) -> Any:
        """What the surrogate's `predict` says at theta, each array [..., *its own axes]."""
        u = self.prior.to_unit(theta)
        made = self.learned.predict(u.reshape(-1, u.shape[-1]))  # type: ignore[attr-defined]
        return jax.tree.map(lambda a: np.asarray(a).reshape((*u.shape[:-1], *a.shape[1:])), made)


@dataclass(frozen=True)
class Fit:
    """Result of `fit` or `Bolfi.fit`; immutable.

    Attributes:
        prior, observed: As given.
        history: Every simulation, in the order told.
        learned: The surrogate over prior quantiles.
        learned_from: Which simulations it knows, bool [n].
        settings: How the run was made.
        seconds: Time in the "simulator" and in the "engine" [s].
    """

    prior: Prior
    observed: np.ndarray
    history: History
    learned: Surrogate
    learned_from: np.ndarray
    settings: Mapping[str, object]
    seconds: Mapping[str, float]

    def __repr__(self) -> str:
        parameters = [f"{name} ~ {of['prior']}" for name, of in self.prior.describe().items()]
        failed = ", ".join(f"{n} {kind}" for kind, n in self.failures.items())
        lines = [
            f"parameters: {', '.join(parameters)}",
            f"simulations: {len(self.history.theta)}, failed: {failed or 'none'}",
            f"surrogate: {self.settings['surrogate']!r}, of {self.learned_from.sum()} simulations",
            f"warnings: {'; '.join(self.warnings) or 'none'}",
        ]
        return "\n  ".join(["Fit", *lines])

    @cached_property
    def warnings(self) -> list[str]:
        """What the surrogate's own checks complain of, and that most simulations failed."""
        failed = int((~self.history.succeeded).sum())
        told = len(self.history.succeeded)
        few = [f"{failed} of {told} simulations failed: the fit rests on {told - failed}"]
        return self.learned.warnings() + (few if failed > told / 2 else [])

    @property
    def surrogate(self) -> SurrogateView:
        return SurrogateView(self.prior, self.learned)

    @property
    def best(self) -> dict[str, float]:
        """The surrogate's best point in the prior's box; theta* of the paper."""
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

    @property
    def _target(self) -> Target:
        return Target(self.learned.log_likelihood, self.learned.state, len(self.prior))

    @in_float64
    def log_prob(self, theta: Theta) -> np.ndarray:
        """Unnormalised log posterior density in natural units, [...]; -inf off the support."""
        u = self.prior.to_unit(theta)
        values = log_likelihood(self._target, u.reshape(-1, u.shape[-1]))
        return self.prior.log_prob(theta) + values.reshape(u.shape[:-1])

    @in_float64
    def sample(  # noqa: PLR0913  each of them is a plain choice of the user's
        self,
        sampler: str = "nuts",
        *,
        chains: int = 4,
        draws: int = 1000,
        warmup: int = 500,
        seed: int = 0,
        extend: int = 8,
    ) -> xr.DataTree:
        """Draw from the posterior, and say whether the draws can be trusted.

        "nuts" and "emcee" first look for the posterior all over the prior: some two thousand
        evaluations of the surrogate give a weighted population of points, every mode with its
        weight. Chains start from it, and propose jumps to wherever a mixture fitted to it
        points, accepted or not by the rule of Metropolis and Hastings. So they change between
        modes that no path connects, and the modes' shares are right, whatever the number of
        chains. Between jumps, "nuts" follows no-U-turn trajectories, with a metric from the
        population and a step size tuned to 90 % acceptance, more where trajectories diverge;
        "emcee" moves an ensemble of walkers for each chain by stretch and differential-evolution
        moves, of which it keeps every k-th, k the autocorrelation time. "quadrature", for one
        or two parameters, cuts the box of prior quantiles into cells until they are even, and
        draws independently.

        The sampler goes on from where it stopped, doubling what it made, while a parameter
        has R-hat above 1.01, or bulk or tail effective sample size below 100 per chain
        (Vehtari et al. 2021; with few draws what `convergence.limits` says), up to `extend`
        times `draws`. The whole is thinned to the `draws` asked for. If that does not suffice,
        if more than 1 % of the transitions diverge, or if (one or two parameters) draws and
        quadrature differ by more than chance explains, a `SamplingWarning` says so, and so
        does `status`.

        A second fit whose arrays have equal shapes compiles nothing anew.

        Args:
            sampler: "nuts", "emcee" or "quadrature".
            chains: Independent chains, at least 2, for R-hat needs them.
            draws: Kept per chain, at least 4.
            warmup: Discarded steps per chain that adapt the sampler.
            seed: Fixes the draws.
            extend: Largest multiple of `draws` to make; 1 never goes on.

        Returns:
            DataTree in ArviZ's schema; opens in ArviZ 0.23 and 1.x, also from `to_netcdf`.
            posterior: draws [chain, draw] in the parameters' own units. Attributes of each:
            `prior`, `units` (where the prior has them), `rhat`, `ess_bulk`, `ess_tail`, and
            Monte Carlo standard errors of mean and 5 and 95 % quantiles, `mcse_mean`,
            `mcse_q05`, `mcse_q95`. Of the group: `status` ("converged", or what is wrong),
            `rhat_max`, `ess_bulk_min`, `ess_tail_min`, `divergences`, `draws_made` (per
            chain, before thinning); for one or two parameters `quadrature_total_variation`
            (of 16 equally probable bins; independent draws as many as the effective ones stay
            below `quadrature_total_variation_limit`) and `log_evidence` of the surrogate's
            likelihood.
            sample_stats: `lp`, log density over Phi^-1(u) of the prior quantiles u, and
            what the sampler records. prior: `draws` draws. observed_data: `signal`.
            posterior_predictive: what the surrogate predicts at some draws, whose indices are
            its coordinate `draw`. constant_data: the surrogate's constants. emulator_checks:
            the surrogate's own checks for each simulation, NaN where it learned nothing from
            one, and what it complains of in the attribute `warnings`. simulations: as
            `Fit.simulations`. The root's attributes hold how the run was made, and the seconds
            it took.

        Raises:
            ValueError: unknown sampler, a length too small, quadrature of more than two
                parameters, or a log likelihood that is finite nowhere.

        Warns:
            SamplingWarning: the draws are not to be trusted; see `status`.
        """
        if sampler not in SAMPLERS:
            raise ValueError(f"sampler must be one of {tuple(SAMPLERS)}, got {sampler!r}")
        if chains < 2 or draws < 4 or warmup < 1 or extend < 1:
            raise ValueError(
                "sampling needs chains >= 2, draws >= 4, warmup >= 1 and extend >= 1, "
                f"got chains={chains}, draws={draws}, warmup={warmup}, extend={extend}"
            )
        started = time.perf_counter()
        length = Length(chains, warmup, draws)
        made = draw_posterior(sampler, self._target, self.prior.names, length, seed, extend)
        seconds = {**self.seconds, "sampling": time.perf_counter() - started}
        rng = np.random.default_rng([seed, 1])
        drawn = self.prior.from_unit(rng.random((draws, len(self.prior))))
        tree = results_tree(self.prior, made.chains, drawn, self.observed, self.simulations)
        tree["posterior"].attrs.update(status=made.status, draws_made=made.steps, **made.checks)
        key = jax.random.key(seed)
        add_surrogate(tree, self.learned, self.learned_from, made.chains.u, key)
        attributes = {
            **self.settings,
            **{"sampler": sampler, **length._asdict(), "extend": extend, "sampling_seed": seed},
            **{f"seconds_{part}": spent for part, spent in seconds.items()},
        }
        return finished(tree, attributes)
