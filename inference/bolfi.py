"""Ask and tell: Bayesian optimisation for likelihood-free inference, one step at a time."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from ._float64 import in_float64
from .acquisition.replicates import next_replicate
from .acquisition.rules import chosen, resolve_acquisition
from .arguments import check_flag, checked_integer, checked_mapping, checked_number, require
from .describe import describe
from .history import UNKNOWN, History, told_errors, told_seeds, told_signals
from .learning import key_words, learned_from, training_data
from .notebook_display import Displayed
from .prior import Prior, check_support, checked_prior
from .result import Fit, Recipe
from .sampling.confirmation import Before
from .simulations.failures import Failure, FailureKind, not_finite
from .simulations.job import BATCH
from .sobol import sobol, start_size
from .surrogates.base import Acquisition, Family
from .surrogates.families import check_options, checked_surrogate, resolve
from .surrogates.warnings import complain
from .types import Theta

MIN_LEARN = 3  # successful simulations before the surrogate may choose
MOST_SIMULATIONS = 8192  # of one run: the processes hold matrices of as many rows and columns


class Bolfi(Displayed):
    """The engine between a prior and a simulator that somebody else runs.

    What is asked depends only on `seed` and on the calls of `ask` and `tell` before, so a run
    that is repeated from its stored simulations goes on as if it had never stopped.

    Args:
        prior: The parameters and their priors.
        observed: The measured output [*signal_shape], time first; NaN is a missing sample. None
            for the surrogate "log_likelihood" alone.
        surrogate: "signal", which emulates the output; "discrepancy", the paper's;
            "log_likelihood", which the simulator returns; an object such as `SignalFamily`; None
            is "signal", unless a discrepancy, or another option of that family alone, is given.
        acquisition: "eiv", "maxvar", "draws", "cautious", "lcb" (with "discrepancy"), an object
            (see `Acquisition`), or None for the surrogate's best.
        seed: Fixes the start design and the acquisitions.
        initial: Points of the Sobol start design; None is 2 d + 6.
        options: Of the surrogate's family, see `SignalFamily` and `DiscrepancyFamily`.

    Attributes:
        asked: Points asked so far.
        history: Simulations told so far; telling more replaces it.
        expected_shape: Of a signal; None where a user's discrepancy or summary takes any.

    Raises:
        ValueError: an argument is not one of the above.

    Example:
        >>> import numpy as np
        >>> import numpyro.distributions as dist
        >>> from bolfi_liquids import inference
        >>> prior = inference.Prior({"decay": dist.LogUniform(0.1, 10)})
        >>> time = np.linspace(0, 5, 50)
        >>> def measure(decay, seed):
        ...     return np.exp(-decay * time) + np.random.default_rng(seed).normal(0, 0.05, 50)
        >>> engine = inference.Bolfi(prior, measure(2.0, 123), noise=0)
        >>> def run(theta):  # on a bench, or in a queue
        ...     decays = enumerate(theta["decay"], start=engine.told)
        ...     engine.tell(theta, [measure(decay, seed) for seed, decay in decays])
        >>> for _ in range(3):
        ...     run(engine.ask(4))
        >>> run(engine.confirm(engine.fit(warn=False)))
        >>> engine.fit().status
        'fitted'
    """

    def __init__(  # noqa: PLR0913  one flat place for what defines a run
        self,
        prior: Prior,
        observed: ArrayLike | None = None,
        *,
        surrogate: str | Family | None = None,
        acquisition: str | Acquisition | None = None,
        seed: int = 0,
        initial: int | None = None,
        **options: Any,
    ):
        checked_prior(prior)
        check_options(options, Bolfi)
        self.prior = prior
        self.family = resolve(surrogate, options)
        self.observed = self.family.observe(observed)
        self._view = self.family.view(self.observed)
        self.family.check_prior(self._view, prior)
        self.seed = checked_integer("seed", seed, 0)
        self.initial = checked_integer(
            "initial",
            start_size(len(prior)) if initial is None else initial,
            MIN_LEARN,
            MOST_SIMULATIONS,
        )
        self._acquire = resolve_acquisition(acquisition, self.family)
        self.settings: dict[str, object] = {
            "surrogate": self.family.name or type(self.family).__name__,
            **{name: describe(value) for name, value in vars(self.family).items()},
            "acquisition": describe(self._acquire),
            "seed": self.seed,
            "initial": self.initial,
        }
        self.expected_shape = None if self.family.any_shape else self.observed.shape
        self.history = self._history(np.zeros((0, len(prior))), (), told_seeds(None, 0), [])
        self.asked = 0
        self._designed = 0  # points asked of the start design's sequence
        self._rounds = 0  # calls of `ask` and `confirm`
        # theta asked and not yet told, and in which round; rebound, for copies share it
        self._pending: tuple[tuple[list[float], int], ...] = ()
        self._learned: Any = None  # the family's surrogate, once there is one
        self._before: Before | None = None  # the posterior of which `confirm` drew
        self._seconds = 0.0
        self.recipe: Recipe | None = None  # of `fit`, where that drives the engine

    def _shown(self) -> list[tuple[str, str]]:
        parameters = [f"{name} ~ {of['prior']}" for name, of in self.prior.describe().items()]
        told = f"{self.told} told, {self.succeeded} to learn from, {len(self._pending)} pending"
        return [
            ("parameters", ", ".join(parameters)),
            ("observed", f"shape {self.observed.shape}"),
            ("simulations", f"{self.asked} asked, {told}"),
            ("surrogate", f"{self.settings['surrogate']!r}"),
            ("acquisition", f"{self.settings['acquisition']}"),
        ]

    @property
    def told(self) -> int:
        """Simulations told so far, failed ones included."""
        return len(self.history.theta)

    @property
    def succeeded(self) -> int:
        """Simulations told so far that gave a finite discrepancy, copies counted once."""
        return int(self.history.distinct.sum())

    def ask(self, n: int = 1) -> dict[str, np.ndarray]:
        """The next n different points to simulate, name -> [n].

        Start-design points first, and for as long as fewer than three simulations have
        succeeded; then the acquisition's, which take everything pending into account.

        Raises:
            ValueError: n < 1.
        """
        n = checked_integer("n", n, 1, MOST_SIMULATIONS)
        started = time.perf_counter()
        designed = self._designed_now(n)
        u = sobol(self.seed, self._designed, self._designed + designed, len(self.prior))
        parts = [self.prior.to_array(self.prior.from_unit(u))]
        if n > designed:
            parts.append(self._acquired(n - designed, parts[0]))
        self._designed += designed
        return self._ask(np.concatenate(parts), started)

    def confirm(self, fit: Fit, n: int = 3) -> dict[str, np.ndarray]:
        """Draws of a fit's posterior to simulate, name -> [n].

        The next `fit` says whether they have moved the posterior, see `Fit.confirmed`. Half are
        as likely as it says; the others lie where it is wide, for there it is known least.

        Args:
            fit: What this engine's `fit` returned last.
            n: How many draws.

        Raises:
            ValueError: bad argument.
        """
        n = checked_integer("n", n, 1, MOST_SIMULATIONS)
        latest = isinstance(fit, Fit) and fit.history is self.history
        require(latest, "fit", "be what `fit` returned last", fit)
        started = time.perf_counter()
        drawn = fit.population.resample(np.random.default_rng([self.seed, self.asked]), n)
        asked = self.prior.to_array(self.prior.from_unit(ndtr(drawn)))
        self._before = Before(*fit.population.moments, fit.learned, self.told, asked, fit.asked)
        return self._ask(asked, started)

    def _ask(self, theta: np.ndarray, started: float) -> dict[str, np.ndarray]:
        """theta [n, d] as it is asked, name -> [n]."""
        self._pending += tuple((point, self._rounds) for point in theta.tolist())
        self._rounds += 1
        self.asked += len(theta)
        self._seconds += time.perf_counter() - started
        return self.prior.to_dict(theta)

    def _designed_now(self, n: int) -> int:
        """Number of the next n points that come from the start design."""
        if self.succeeded < MIN_LEARN:
            return n
        covered = self.succeeded + len(self._pending)
        return min(n, max(0, self.initial - covered))

    @in_float64
    def _acquired(self, n: int, designed: np.ndarray) -> np.ndarray:
        """theta [n, d] of the engine's choice, `designed` [m, d] being asked with them."""
        points = [point for point, _ in self._pending] + designed.tolist()
        pending = np.reshape(points, (-1, len(self.prior)))
        words = key_words(self.seed, self.asked)
        known = training_data(self._view, self.history, self.prior)
        found = self.family.search(known, words, self._learned)
        self._learned = checked_surrogate(found, self.family)
        repeated = next_replicate(self.history, pending) if self.family.replicates else None
        parts = [] if repeated is None else [repeated[None]]
        if n > len(parts):
            key = jax.random.wrap_key_data(jax.device_put(words), impl="threefry2x32")
            fantasized = self._learned.fantasize(self.prior.to_unit(self.prior.to_dict(pending)))
            shape = n - len(parts), len(self.prior)
            u = chosen(self._acquire(key, fantasized, shape[0]), shape)
            parts.append(self.prior.to_array(self.prior.from_unit(u)))
        return np.concatenate(parts)

    def tell(
        self,
        theta: Theta,
        signals: ArrayLike,
        seeds: ArrayLike | None = None,
        errors: Sequence[str | Failure | None] | None = None,
    ) -> None:
        """Give the engine finished simulations: any number, any order, asked for or not.

        A row of NaN reports a failed run. It counts as told, but nothing is learned from it. So
        does whatever is no signal among a list or tuple of signals, and a signal on which the
        user's own discrepancy or summary fails.

        Args:
            theta: Name -> [n], in the prior's support.
            signals: [n, *signal_shape], or a list of n signals; these may be of any shapes where
                a discrepancy or summary of the user's own compares them.
            seeds: Seeds of the runs [n], to be kept with the results. Of runs with equal theta,
                seed and signal one is learned from. Without seeds what is told twice counts twice.
            errors: Why a run failed [n], to be kept for rows of NaN; "" or None elsewhere. A text
                counts as raised; `Fit.history.why` keeps the kinds.

        Raises:
            ValueError: shapes disagree, theta lies outside the prior's support, or the user's
                discrepancy or summary has failed on each of the first four signals.
        """
        started = time.perf_counter()
        natural = np.atleast_2d(self.prior.to_array(theta))
        n = len(natural)
        if self.told + n > MOST_SIMULATIONS:
            raise ValueError(
                f"theta holds {n} simulations beside the {self.told} told before; a run may have "
                f"{MOST_SIMULATIONS} in all: leave the least useful out"
            )
        outputs, faults = told_signals(signals, n, self.expected_shape)
        check_support(self.prior, self.prior.to_dict(natural))
        told = self._history(natural, outputs, told_seeds(seeds, n), faults, errors)
        self._check_compared(told)
        rounds, pending = self._settled(natural)
        history = self.history.and_then(told._replace(rounds=rounds))
        self.history, self._pending = history, pending
        self._seconds += time.perf_counter() - started

    def _history(
        self,
        theta: np.ndarray,
        outputs: tuple[np.ndarray | None, ...],
        seeds: np.ndarray,
        faults: Sequence[Failure | None],
        errors: Sequence[str | Failure | None] | None = None,
    ) -> History:
        """Simulations at theta [n, d] in view of what was observed, their rounds unknown.

        Args:
            outputs, seeds: See `History`.
            faults: Why some outputs are no signals [n].
            errors: As a user tells them.
        """
        rows = self.prior.to_dict(theta)
        measured = self.family.measure(self._view, outputs)
        good = np.isfinite(measured.discrepancy)
        gaps = int(np.isnan(self.observed).sum())
        missing = f"; observed holds {gaps} NaN: let discrepancy leave them out" if gaps else ""
        why = np.full(len(theta), None)
        known = zip(faults, measured.errors, told_errors(errors, good), strict=True)
        for i, (fault, compared, told) in enumerate(known):
            if compared is not None:
                point = {name: float(column[i]) for name, column in rows.items()}
                run = f"{point}" if seeds[i] == UNKNOWN else f"{point}, seed {seeds[i]}"
                compared = replace(compared, text=f"{compared.text} of {run}")
            if not good[i]:
                output = outputs[i]
                finite = output is not None and np.isfinite(output).all()
                blank = not_finite(f"the discrepancy{missing}" if finite else "the signal")
                why[i] = fault or compared or told or blank
        return History(
            theta=theta,
            u=self.prior.to_unit(rows),
            outputs=outputs,
            features=measured.features,
            discrepancy=measured.discrepancy,
            seeds=seeds,
            rounds=np.full(len(theta), UNKNOWN),
            why=why,
            observed_shape=self.observed.shape,
        )

    def _settled(self, theta: np.ndarray) -> tuple[np.ndarray, tuple[tuple[list[float], int], ...]]:
        """Rounds [n] in which theta [n, d] was asked, and what is pending without it; UNKNOWN of
        what was never asked: simulations made elsewhere are welcome."""
        rounds, pending = np.full(len(theta), UNKNOWN), list(self._pending)
        for row, point in enumerate(theta.tolist()):
            places = [place for place, (asked, _) in enumerate(pending) if asked == point]
            if places:
                rounds[row] = pending.pop(places[0])[1]
        return rounds, tuple(pending)

    def _check_compared(self, told: History) -> None:
        """Raise ValueError if the user's own function failed on all of the first signals.

        One on which it fails is a failed run; where none of the first can be compared, all would
        fail in the same way.
        """
        if self.succeeded or told.succeeded.any():
            return
        failed = [
            failure
            for failure in (*self.history.why, *told.why)
            if failure is not None and failure.kind is FailureKind.INCOMPARABLE
        ]
        if len(failed) >= BATCH:
            raise ValueError(failed[-1].text)

    def fit(
        self, seconds: Mapping[str, float] | None = None, *, warn: bool = True, stacklevel: int = 2
    ) -> Fit:
        """Fit the surrogate to the simulations told so far.

        Args:
            seconds: Times that the caller measured (such as the simulator's), to be kept.
            warn: Whether each of the surrogate's complaints is raised as a warning.
            stacklevel: Of the warnings; 2 blames the line that calls this.

        Raises:
            ValueError: bad argument; fewer than three simulations succeeded.

        Warns:
            EmulatorWarning: for each of the surrogate's complaints, unless warn=False; they are
                in `Fit.warnings` in any case.
        """
        measured = {
            part: checked_number(f"seconds[{part!r}]", spent, np.isfinite, "a time [s]")
            for part, spent in checked_mapping("seconds", seconds, "times [s]").items()
        }
        check_flag("warn", warn)
        stacklevel = checked_integer("stacklevel", stacklevel)
        if self.succeeded < MIN_LEARN:
            raise ValueError(
                f"a fit needs {MIN_LEARN} successful simulations, got {self.succeeded} of "
                f"{self.told} told; tell more{self.history.last_error}"
            )
        started = time.perf_counter()
        known = training_data(self._view, self.history, self.prior)
        fitted = learned_from(self.family, known, key_words(self.seed, self.asked))
        self._seconds += time.perf_counter() - started
        made = Fit(
            prior=self.prior,
            observed=self.observed,
            family=self.family,
            history=self.history,
            learned=fitted,
            settings=self.settings,
            seconds={"simulator": 0.0, **measured, "engine": self._seconds},
            before=self._before,
            made_by=self.recipe,
            asked=self.asked,
        )
        if warn:
            complain(made.warnings, stacklevel + 1)
        return made
