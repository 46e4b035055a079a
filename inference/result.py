"""The result of a run: posterior, best hypothesis, surrogate, simulations."""

import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from ._float64 import in_float64
from ._lazy import xr
from .arguments import check_flag, check_kind, checked_array, checked_integer, require
from .history import History
from .interval_error import interval_error
from .learning import training_mask
from .notebook_display import Displayed
from .posterior_tree import tree_of
from .prior import Prior
from .sampling.confirmation import Before
from .sampling.convergence import SamplingWarning
from .sampling.draw import SAMPLERS, draw_posterior
from .sampling.importance import (
    LEAST,
    Evidence,
    Population,
    evidence_of,
    explore,
    weighted_quantiles,
)
from .sampling.target import Length, Target, log_likelihood
from .sensitivity import sobol_indices
from .stored_fit import check_same, read_fit, write_fit
from .surrogates.base import Family, Surrogate, SurrogateView
from .surrogates.warnings import (
    COLLAPSED,
    DOUBTED,
    censored_warnings,
    history_warnings,
    shape_warnings,
    unconfirmed_warnings,
)
from .types import Simulator, Theta

LEAST_EFFECTIVE = 32.0  # points of a population that stand for a posterior
MUCH_DOUBT = 1.5  # see `Fit.doubt`: beyond it more is simulated, and a fit warns
MOST_MORE = 1000  # runs, of which `Fit.interval_error` tells
TEN_MORE = 10  # runs, of which a printed fit says what they would bring
MOST_CHAINS, MOST_DRAWS = 1000, 1_000_000  # of one call: more would take days, or all memory


@dataclass(frozen=True)
class Recipe:
    """How `fit` made a fit, and what can be done with that.

    Attributes:
        simulate: The simulator, of batches.
        identity: Its name in a bank.
        budget: Simulations in all, or an `Until`.
        options: Other arguments of `fit` that the result depends on; "surrogate" is a family.
        fit: `fit` itself: a result knows nothing of the loop that makes it.
        check, criticise: `checks.check_fit` and `criticism.criticise_fit`, likewise.
    """

    simulate: Simulator
    identity: str
    budget: Any
    options: Mapping[str, Any]
    fit: Callable[..., "Fit"]
    check: Callable[..., Any] = field(compare=False)
    criticise: Callable[..., Any] = field(compare=False)


class Closest(NamedTuple):
    """The simulation that came nearest to what was observed."""

    theta: dict[str, float]
    signal: np.ndarray
    discrepancy: float


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Displayed):
    """Result of `fit` or `Bolfi.fit`; immutable.

    Attributes:
        prior, observed: As given.
        family: Of the surrogate, with its options.
        history: Every simulation, in the order told.
        learned: The surrogate over prior quantiles.
        settings: How the run was made.
        seconds: Time in the "simulator" and in the "engine" [s].
        before: The posterior of which `Bolfi.confirm` drew last; None where it never did.
        made_by: How it was made; None if not by `fit`, or without a simulator, or if the fit was
            copied, pickled or loaded, for simulators may not be.
        asked: Points that had been asked when it was made.

    Example:
        >>> import numpy as np
        >>> import numpyro.distributions as dist
        >>> from bolfi_liquids import inference
        >>> prior = inference.Prior({"decay": dist.LogUniform(0.1, 10)})
        >>> time = np.linspace(0, 5, 50)
        >>> def simulate(theta, seed):
        ...     noise = np.random.default_rng(seed).normal(0, 0.05, time.size)
        ...     return np.exp(-theta["decay"] * time) + noise
        >>> observed = simulate({"decay": 2.0}, 123)
        >>> fit = inference.fit(simulate, prior, observed, budget=12, noise=0, vectorised=False)
        >>> low, high = fit.sample("quadrature")["posterior"]["decay"].quantile([0.05, 0.95])
        >>> bool(low < 2.0 < high)
        True
        >>> density = fit.log_prob({"decay": np.array([1.0, 2.0, 4.0])})
        >>> int(density.argmax())
        1
        >>> fit.simulations["decay"].shape  # 12, and 3 at draws of the posterior
        (15,)
    """

    prior: Prior
    observed: np.ndarray
    family: Family
    history: History
    learned: Surrogate
    settings: Mapping[str, object]
    seconds: Mapping[str, float]
    before: Before | None = None
    made_by: Recipe | None = None
    asked: int = 0

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "made_by": None}

    @cached_property
    def training_mask(self) -> np.ndarray:
        """Which simulations the surrogate knows, bool [n]."""
        return training_mask(self.history)

    @property
    def recipe(self) -> Recipe:
        """The simulator, and how `fit` made this of it.

        Raises:
            ValueError: that is not known, see `made_by`.
        """
        if self.made_by is None:
            raise ValueError(
                "the fit has no simulator: `fit` did not make it from one, or it was copied, "
                "pickled or loaded; check inference.FitPipeline(simulate, prior) by "
                "inference.replicates, or criticise a "
                "criticism.Experiment(simulate, observed, noise)"
            )
        return self.made_by

    @in_float64
    def _shown(self) -> list[tuple[str, str]]:
        failed = ", ".join(f"{n} {kind}" for kind, n in self.failures.items())
        surrogate = f"{self.settings['surrogate']!r}, of {self.training_mask.sum()} simulations"
        return [
            ("parameters", ", ".join(self._intervals())),
            *self._interval_ends(),
            ("simulations", f"{len(self.history.theta)}, failed: {failed or 'none'}"),
            ("discrepancy", self._discrepancies()),
            ("surrogate", ", ".join([surrogate, *self.learned.described()])),
            ("status", f"{self.status}{'' if len(self._drawn) else ': no runs at its draws'}"),
            ("warnings", "; ".join(self.warnings) or "none"),
        ]

    @in_float64
    def quantiles(self, levels: ArrayLike = (0.05, 0.5, 0.95)) -> dict[str, np.ndarray]:
        """Quantiles of each parameter's posterior at these levels, without sampling: of the
        weighted points of `population`.

        Raises:
            ValueError: levels that are not numbers from 0 to 1.
        """
        shares = np.atleast_1d(checked_array("levels", levels))
        within = bool(((shares >= 0.0) & (shares <= 1.0)).all())
        require(within, "levels", "lie between 0 and 1", levels)
        theta, weights = self.prior.from_unit(ndtr(self.population.x)), self.population.weights
        return {name: weighted_quantiles(values, weights, shares) for name, values in theta.items()}

    def _intervals(self) -> list[str]:
        """Median and 90 % interval of each parameter."""
        return [
            f"{name} {middle:.4g} ({low:.4g} to {high:.4g})"
            for name, (low, middle, high) in self.quantiles().items()
        ]

    def _interval_ends(self) -> list[tuple[str, str]]:
        """How well they are known, and what ten more runs would bring; nothing where no surrogate
        says that."""
        now, then = self.interval_error(), self.interval_error(TEN_MORE)
        said = (
            f"known to {now:.2g} sds of the posterior, about {then:.2g} after {TEN_MORE} more runs"
        )
        return [] if np.isnan(now) else [("interval ends", said)]

    def _discrepancies(self) -> str:
        """Discrepancies of the closest run, and of those at draws of the posterior."""
        said = f"{self.closest.discrepancy:.4g} of the closest run"
        worth = ["failed" if np.isnan(one) else f"{one:.4g}" for one in self._drawn]
        return (
            f"{said}, {', '.join(worth)} at draws of the posterior before them" if worth else said
        )

    @cached_property
    @in_float64
    def warnings(self) -> list[str]:
        """Sentences of what may be wrong, each with its cure.

        They come from the surrogate, the simulations, the data and the runs at draws of the
        posterior. Fewer than 2 d + 2 learned simulations are one: a level, a slope and a curvature
        along each of d parameters, and one that could contradict.
        """
        said = self.learned.warnings(confirmed=self.confirmed is True)
        said += history_warnings(self.history)
        if getattr(self.family, "summary", None) is not None:
            said += shape_warnings(self.history)
        if {self.settings.get("summary", "None"), self.settings.get("discrepancy")} == {"None"}:
            said += censored_warnings(self.observed, self.closest.signal)
        if self.doubt > MUCH_DOUBT:
            said.append(DOUBTED)
        if self.confirmed is False:
            said += unconfirmed_warnings(self.history, self.confirming)
        if self._collapsed:
            said.append(COLLAPSED)
        learned, needed = int(self.training_mask.sum()), 2 * len(self.prior) + 2
        if learned < needed:
            said.append(
                f"the surrogate is learned from {learned} simulations, fewer than the {needed} "
                f"that {len(self.prior)} parameters need: simulate more; until then the posterior "
                "may be far off"
            )
        return said

    @property
    @in_float64
    def status(self) -> str:
        """ "fitted"; "not confirmed", where runs at draws of the posterior moved it, or none were
        made, or the emulator's doubt makes it much wider; or, where that is not so or unknown, "not
        fitted": parameters and noise do not explain what was observed."""
        unsure = self.confirmed is False or self.doubt > MUCH_DOUBT or self._collapsed
        if not self.learned.fits and not unsure:
            return "not fitted"
        return "fitted" if self.confirmed and not unsure else "not confirmed"

    @property
    def _collapsed(self) -> bool:
        """Whether too few points stand for the posterior to tell where it lies."""
        return self.population.effective < LEAST_EFFECTIVE

    @cached_property
    @in_float64
    def population(self) -> Population:
        """Weighted points of the posterior, which depend on nothing but the surrogate."""
        return explore(np.random.default_rng(0), self._target)

    @cached_property
    @in_float64
    def confirmed(self) -> bool | None:
        """Whether what was simulated at draws of the posterior left it where it was, see
        `Before.holds`; None where nothing was."""
        if self.before is None:
            return None
        return self.before.holds(self.history, *self.population.moments)

    @property
    def confirming(self) -> np.ndarray:
        """Rows of the runs that were made last at draws of the posterior, int [n]."""
        return np.zeros(0, int) if self.before is None else self.before.runs(self.history)

    @property
    def _drawn(self) -> np.ndarray:
        """Discrepancies of the runs at draws of the posterior, NaN where one failed."""
        return self.history.discrepancy[self.confirming]

    @cached_property
    @in_float64
    def doubt(self) -> float:
        """The largest ratio, over parameters, of the posterior's root mean square distance from the
        mean that it would have, were the emulator sure, to the sd that it would have then: 1 where
        the simulator is as good as known."""
        found, target = self.population, self._target
        surely = target._replace(log_likelihood=self.learned.sure)
        at = ndtr(found.x)
        change = log_likelihood(surely, at) - log_likelihood(target, at)
        there = np.isfinite(found.log_weights + change)
        log_weights = found.log_weights[there] + change[there]
        known = found._replace(x=found.x[there], log_weights=log_weights)
        (mean, sd), (sure_mean, sure_sd) = found.moments, known.moments
        return float(np.max(np.hypot(sd, mean - sure_mean) / np.maximum(sure_sd, LEAST)))

    @in_float64
    def interval_error(self, more: int = 0) -> float:
        """Error of the parameters' 90 % intervals that the surrogate's uncertainty allows, in the
        posterior's sds: the largest of all ends, see `interval_error.interval_error`. NaN where the
        surrogate cannot tell.

        Args:
            more: Simulations at draws of the posterior, at most 1000, after which it is expected;
                of 18 fits half were within a factor of two of what was expected.
        """
        more, learned = checked_integer("more", more, 0, MOST_MORE), self.learned
        if more:
            drawn = self.population.resample(np.random.default_rng(0), more)
            learned = learned.fantasize(ndtr(drawn))
        return interval_error(self.population, self.learned.log_likelihood, learned)

    @property
    def surrogate(self) -> SurrogateView:
        return SurrogateView(self.prior, self.learned)

    @property
    @in_float64
    def best(self) -> dict[str, float]:
        """The surrogate's best point in the prior's box; theta* of the paper."""
        return {n: float(v) for n, v in self.prior.from_unit(self.learned.best()).items()}

    @property
    def closest(self) -> Closest:
        """The simulated hypothesis of least discrepancy."""
        i = int(np.nanargmin(self.history.discrepancy))
        theta = {n: float(v) for n, v in self.prior.to_dict(self.history.theta[i]).items()}
        return Closest(theta, self.history.signal(i), float(self.history.discrepancy[i]))

    @property
    def simulations(self) -> "xr.Dataset":
        """Every simulation in the order told: theta, seed, round, discrepancy, failed, error,
        signal. Where a discrepancy compares unlike shapes, `signal` holds those of the commonest
        and NaN elsewhere; `history.signal(row)` is any of them."""
        history = self.history
        signals = history.signals
        axes = [f"signal_dim_{i}" for i in range(signals.ndim - 1)]
        columns = {
            **self.prior.to_dict(history.theta),
            "seed": history.seeds,
            "round": history.rounds,
            "discrepancy": history.discrepancy,
            "failed": ~history.succeeded,
            "error": history.errors,
        }
        return xr.Dataset(
            {name: ("simulation", values) for name, values in columns.items()}
            | {"signal": (["simulation", *axes], signals)}
        )

    @property
    def failures(self) -> dict[str, int]:
        """Numbers of failed simulations by kind: "raised", "not finite", "timeout", "unusable" (no
        signal), "incomparable" (your own discrepancy or summary failed) or "impossible"."""
        return self.history.failures

    @property
    def _target(self) -> Target:
        return Target(self.learned.log_likelihood, len(self.prior))

    @in_float64
    def log_prob(self, theta: Theta) -> np.ndarray:
        """Unnormalised log posterior density in natural units, [...]; -inf off the support."""
        u = self.prior.to_unit(theta)
        values = log_likelihood(self._target, u.reshape(-1, u.shape[-1]))
        return self.prior.log_prob(theta) + values.reshape(u.shape[:-1])

    @cached_property
    @in_float64
    def evidence(self) -> Evidence:
        """Log of the probability density of what was observed, averaged over the prior.

        It is that of the model as it is stated: the simulator and the noise, without the misfit
        that keeps the posterior from trusting either too far. Differences between models of the
        same data are logs of Bayes factors. Of the surrogate "discrepancy" it is the probability of
        a discrepancy below the threshold; of "log_likelihood" it has the constant that the
        simulator's values have, and of `fit_losses` none: it then tells models of one noise apart,
        not noises. NaN where all outputs are equal. The error holds chance and what the emulator
        does not know; noise that is estimated from runs counts as known.
        """
        learned, population = self.learned.stated, self.population
        target = Target(learned.log_likelihood, len(self.prior))
        if learned is not self.learned:
            population = explore(np.random.default_rng(0), target)
        log, error = evidence_of(population, target, learned.log_second_moment)
        error = float(np.sqrt(error**2 + learned.log_variance))
        return Evidence(log + learned.log_constant, error)

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
        warn: bool = True,
    ) -> "xr.DataTree":
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

        Args:
            sampler: "nuts", "emcee" or "quadrature".
            chains: Independent chains, at least 2, for R-hat needs them, and at most 1000.
            draws: Kept per chain, at least 4 and at most a million.
            warmup: Discarded steps per chain that adapt the sampler.
            seed: Fixes the draws.
            extend: Largest multiple of `draws` to make; 1 never goes on.
            warn: Whether draws that are not to be trusted raise a `SamplingWarning`; the
                posterior's attribute `status` says so in any case.

        Returns:
            DataTree in ArviZ's schema, draws in the parameters' own units, with R-hat, effective
            sample sizes and Monte Carlo errors; `inference.posterior_tree` describes groups and
            attributes. Opens in ArviZ 0.23 and 1.x, also from `to_netcdf`.

        Raises:
            ValueError: unknown sampler, a length out of range, quadrature of more than two
                parameters, or a log likelihood that is finite nowhere.

        Warns:
            SamplingWarning: the draws are not to be trusted; see `status`.
        """
        known = tuple(SAMPLERS)
        require(sampler in known, "sampler", f"be one of {known}", sampler)
        chains = checked_integer("chains", chains, 2, MOST_CHAINS)
        draws = checked_integer("draws", draws, 4, MOST_DRAWS)
        warmup = checked_integer("warmup", warmup, 1, MOST_DRAWS)
        extend = checked_integer("extend", extend)
        seed = checked_integer("seed", seed, 0)
        check_flag("warn", warn)
        started = time.perf_counter()
        length = Length(chains, warmup, draws)
        made = draw_posterior(sampler, self._target, self.prior.names, length, seed, extend)
        if warn and made.found:
            warnings.warn(made.status, SamplingWarning, stacklevel=3)  # beyond `in_float64`
        seconds = {**self.seconds, "sampling": time.perf_counter() - started}
        attributes: dict[str, object] = {
            **self.settings,
            **{"sampler": sampler, **length._asdict(), "extend": extend, "sampling_seed": seed},
            "fit_status": self.status,
            **{f"seconds_{part}": spent for part, spent in seconds.items()},
        }
        return tree_of(self, made, seed, attributes)

    @in_float64
    def sobol(self, n: int = 2048, *, seed: int = 0) -> "xr.Dataset":
        """Sobol indices of the emulated output with respect to the prior.

        No simulator is run: they are as good as the emulator is, see `Fit.warnings`, over the whole
        prior, and know nothing of the data. Those of the surrogates "discrepancy" and
        "log_likelihood" are of the transformed discrepancy and of the log likelihood.

        Args:
            n: Points of each design, a power of two; n (d + 2) evaluations of the emulator.
            seed: Fixes them.

        Returns:
            Over `parameter` and the output's axes: `first`, the share of the variance that a
            parameter makes alone (Saltelli et al. 2010), and `total`, with all its interactions
            (Jansen 1999); NaN of what does not vary. Over `parameter`: `first_of_all` and
            `total_of_all`, the same of the whole output, weighted by variance (Lamboni et al. 2011,
            Gamboa et al. 2014).

        Raises:
            ValueError: `n` is no power of two, or no value varies.
        """
        n = checked_integer("n", n, 2, MOST_DRAWS)
        require(n.bit_count() == 1, "n", "be a power of two", n)
        return sobol_indices(self.prior, self.learned, n, checked_integer("seed", seed, 0))

    @in_float64
    def report(self, path: str | Path, tree: "xr.DataTree | None" = None) -> Path:
        """Write one HTML page: parameters, whether the model fits, the emulator, what to do next.

        Args:
            path: Of the page, which needs nothing from outside it.
            tree: What `sample` of this fit has returned; None samples now.

        Returns:
            The page.

        Raises:
            ValueError: bad argument, or draws of another fit.
            OSError: it cannot be written.
        """
        from .fit_report import write_report

        check_kind("path", path, str | Path)
        if tree is not None:
            check_kind("tree", tree, xr.DataTree)
            held = tree["posterior"].attrs if "posterior" in tree.children else {}
            own = np.array_equal(
                held.get("log_evidence", np.inf), self.evidence.log, equal_nan=True
            )
            require(own, "tree", "be what `sample` of this fit has returned", tree)
        return write_report(path, self, self.sample(warn=False) if tree is None else tree)

    def save(self, path: str | Path) -> Path:
        """Write the fit to one file, without pickle: prior, data, every simulation, and how it was
        made. The simulator, functions and rules such as `relative(0.2)` are not in it.

        Returns:
            The file, a zip archive whose `fit.json` says how the fit was made.

        Raises:
            OSError: it cannot be written; nothing is left of it then.
        """
        return write_fit(path, self)

    @classmethod
    def load(
        cls,
        path: str | Path,
        *,
        prior: Prior | None = None,
        surrogate: Family | None = None,
        **options: Any,
    ) -> Self:
        """The fit that `save` wrote: learned again from its simulations, with the same bits.

        It has no simulator: it cannot `check` or `criticise`.

        Args:
            path: Of the file.
            prior: Where its distributions are more than their numbers, and for none other.
            surrogate: The object, where it is of a class of your own.
            options: Functions and objects that were options of the surrogate, such as
                `discrepancy=...`, `summary=...` and `noise=...`.

        Raises:
            OSError: there is no such file.
            ValueError: it is none of `save`, or one of another version of the engine; something
                that must be given is missing, or is not what the fit was made with, by its
                description, or by discrepancies and posterior densities at the simulations.
        """
        fields, arrays = read_fit(path, prior, surrogate, options)
        made = cls(**fields)
        check_same(path, arrays, made)
        return made

    def check(self, n: int = 200, **how: Any) -> Any:
        """Ranks and coverage of the pipeline that made this fit, on n data sets of known truth.

        Each truth is drawn from the prior, and its data are simulated, fitted and sampled as these
        data were, with as many simulations.

        Args:
            n: Data sets.
            how: See `checks.check_fit`.

        Returns:
            A `checks.FitCheck`.

        Raises:
            ValueError: the fit has no `recipe`, or an argument is bad.
        """
        return self.recipe.check(self, n, **how)

    def criticise(self, extensions: Mapping[str, Any], **how: Any) -> Any:
        """Where simulator and data disagree, and which of the extensions explains it.

        The simulations of this fit are those of the base model, whatever the surrogate.

        Args:
            extensions: Name -> `criticism.Extension`, which the simulator may lack.
            how: See `criticism.criticise_fit`.

        Returns:
            A `criticism.Criticism`.

        Raises:
            ValueError: the fit has no `recipe`, its noise is not known, or an argument is bad.
        """
        return self.recipe.criticise(self, extensions, **how)
