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
from .arguments import Unusable, check_flag, checked_integer, checked_mapping
from .describe import describe
from .history import (
    UNKNOWN,
    History,
    explain,
    init,
    outputs_of,
    remember_asked,
    remember_told,
    told_errors,
    told_seeds,
)
from .notebook_display import Displayed
from .prior import Prior, check_support, checked_prior
from .result import Fit, Recipe
from .sampling.confirmation import Before
from .simulations.failures import Failure, FailureKind, unusable
from .simulations.job import BATCH
from .simulations.returned import told_signals
from .sobol import sobol, start_size
from .surrogates.base import Acquisition, Family, Measured, RunOutcomes, TrainingData
from .surrogates.discrepancy import is_outlier
from .surrogates.families import checked_surrogate, resolve
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

    Raises:
        ValueError: an argument is not one of the above.
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
        self.prior = prior
        self.family = resolve(surrogate, options)
        self.observed = self.family.observe(observed)
        self._view = self.family.view(self.observed)
        self.seed = checked_integer("seed", seed, 0)
        self.initial = checked_integer(
            "initial",
            start_size(len(prior)) if initial is None else initial,
            MIN_LEARN,
            MOST_SIMULATIONS,
        )
        name = self.family.name or type(self.family).__name__
        self._acquire = resolve_acquisition(acquisition, self.family)
        self.settings: dict[str, object] = {
            "surrogate": name,
            **{name: describe(value) for name, value in vars(self.family).items()},
            "acquisition": describe(self._acquire),
            "seed": self.seed,
            "initial": self.initial,
        }
        features = self.family.measure(self._view, []).features
        self._state = init(len(prior), self.observed.shape, features)
        self._learned: Any = None  # the family's surrogate, once there is one
        self._before: Before | None = None  # the posterior of which `confirm` drew
        self._seconds = 0.0
        self.recipe: Recipe | None = None  # of `fit`, where that drives the engine

    def _shown(self) -> list[tuple[str, str]]:
        parameters = [f"{name} ~ {of['prior']}" for name, of in self.prior.describe().items()]
        told = (
            f"{self.told} told, {self.succeeded} to learn from, {len(self._state.pending)} pending"
        )
        return [
            ("parameters", ", ".join(parameters)),
            ("observed", f"shape {self.observed.shape}"),
            ("simulations", f"{self.asked} asked, {told}"),
            ("surrogate", f"{self.settings['surrogate']!r}"),
            ("acquisition", f"{self.settings['acquisition']}"),
        ]

    @property
    def asked(self) -> int:
        """Points asked so far."""
        return self._state.asked

    @property
    def told(self) -> int:
        """Simulations told so far, failed ones included."""
        return len(self.history.theta)

    @property
    def succeeded(self) -> int:
        """Simulations told so far that gave a finite discrepancy, copies counted once."""
        return int(self.history.distinct.sum())

    @property
    def history(self) -> History:
        """Simulations told so far."""
        return self._state.history

    @property
    def expected_shape(self) -> tuple[int, ...] | None:
        """Of a signal; None where a user's discrepancy or summary takes signals of any shape."""
        return None if self.family.any_shape else self.history.signal_shape

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
        start = self._state.designed
        u = sobol(self.seed, start, start + designed, len(self.prior))
        parts = [self.prior.to_array(self.prior.from_unit(u))]
        if n > designed:
            parts.append(self._acquired(n - designed, parts[0]))
        asked = np.concatenate(parts)
        self._state = remember_asked(self._state, asked, designed)
        theta = self.prior.to_dict(asked)
        self._seconds += time.perf_counter() - started
        return theta

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
        if not isinstance(fit, Fit) or fit.history is not self.history:
            raise ValueError(f"fit must be what `fit` returned last, got {fit!r:.100}")
        started = time.perf_counter()
        drawn = fit.population.resample(np.random.default_rng([self.seed, self.asked]), n)
        asked = self.prior.to_array(self.prior.from_unit(ndtr(drawn)))
        self._before = Before(*fit.population.moments, fit.learned, self.told, asked)
        self._state = remember_asked(self._state, asked, 0)
        self._seconds += time.perf_counter() - started
        return self.prior.to_dict(asked)

    def _designed_now(self, n: int) -> int:
        """Number of the next n points that come from the start design."""
        if self.succeeded < MIN_LEARN:
            return n
        covered = self.succeeded + len(self._state.pending)
        return min(n, max(0, self.initial - covered))

    @in_float64
    def _acquired(self, n: int, designed: np.ndarray) -> np.ndarray:
        """theta [n, d] of the engine's choice, `designed` [m, d] being asked with them."""
        pending = np.concatenate([self._state.pending, designed])
        words = self._words()
        found = self.family.search(self._training_data(), words, self._learned)
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

    def _words(self) -> np.ndarray:
        """A key of JAX as NumPy makes it: JAX would compile for half a second."""
        return np.random.SeedSequence([self.seed, self._state.asked]).generate_state(2)

    @property
    def _training_mask(self) -> np.ndarray:
        """Which runs are learned from, bool [n]: no copies, nor what blew up."""
        return self.history.distinct & ~is_outlier(self.history.discrepancy)

    def _training_data(self) -> TrainingData:
        history, good = self.history, self._training_mask
        known = self._view, history.u[good], history.features[good], history.discrepancy[good]
        # runs that blew up did not succeed
        succeeded = history.succeeded & ~is_outlier(history.discrepancy)
        return TrainingData(*known, self.prior.normal, RunOutcomes(history.u, succeeded))

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
                seed and signal one is learned from.
            errors: Why a run failed [n], to be kept for rows of NaN; "" or None elsewhere. A text
                counts as raised; `Fit.history.why` keeps the kinds.

        Raises:
            ValueError: shapes disagree, theta lies outside the prior's support, or the user's
                discrepancy or summary has failed on each of the first four signals.
        """
        started = time.perf_counter()
        natural = np.atleast_2d(self.prior.to_array(theta))
        if self.told + len(natural) > MOST_SIMULATIONS:
            raise ValueError(
                f"theta holds {len(natural)} simulations beside the {self.told} told before; a run "
                f"may have {MOST_SIMULATIONS} in all: leave the least useful out"
            )
        rows = self.prior.to_dict(natural)
        told_rows, faults = self._signals(len(natural), signals)
        check_support(self.prior, rows)
        given_seeds = told_seeds(seeds, len(natural))
        measured = self.family.measure(self._view, told_rows)
        measured = _located(measured, rows, given_seeds)
        given_errors = told_errors(errors, np.isfinite(measured.discrepancy))
        self._check_compared(measured)
        known = [a or b or c for a, b, c in zip(faults, measured.errors, given_errors, strict=True)]
        told = History(
            theta=natural,
            u=self.prior.to_unit(rows),
            outputs=outputs_of(told_rows),
            features=measured.features,
            discrepancy=measured.discrepancy,
            seeds=given_seeds,
            rounds=np.full(len(natural), UNKNOWN),
            why=explain(told_rows, measured.discrepancy, known),
            observed_shape=self.observed.shape,
        )
        self._state = remember_told(self._state, told)
        self._seconds += time.perf_counter() - started

    def _check_compared(self, measured: Measured) -> None:
        """Raise ValueError if the user's own function failed on all of the first signals.

        One on which it fails is a failed run; where none of the first can be compared, all would
        fail in the same way.
        """
        if self.succeeded or np.isfinite(measured.discrepancy).any():
            return
        failed = [
            failure
            for failure in (*self.history.why, *measured.errors)
            if failure is not None and failure.kind is FailureKind.INCOMPARABLE
        ]
        if len(failed) >= BATCH:
            raise ValueError(failed[-1].text)

    def _signals(
        self, n: int, signals: ArrayLike
    ) -> tuple[Sequence[np.ndarray | None], list[Failure | None]]:
        """The n signals told, None where something else was, and what that was."""
        shape = self.expected_shape
        try:
            rows, faults = told_signals(signals, n, shape)
        except Unusable as error:
            if error.shape is None:
                raise ValueError(
                    f"signals must be an array of numbers, got {signals!r:.100}"
                ) from error
            due = (n, *(error.shape[1:] if shape is None else shape))
            raise ValueError(
                f"signals must have shape {due}, one row per theta, got {error.shape}"
            ) from error
        due = "an array of numbers" if shape is None else shape
        return rows, [
            unusable(f"{fault} was told, {due} is due") if fault else None for fault in faults
        ]

    def fit(
        self,
        seconds: Mapping[str, float] | None = None,
        *,
        warn: bool = True,
        stacklevel: int = 2,
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
        measured = checked_mapping("seconds", seconds, "times [s]")
        check_flag("warn", warn)
        stacklevel = checked_integer("stacklevel", stacklevel)
        if self.succeeded < MIN_LEARN:
            raise ValueError(
                f"a fit needs {MIN_LEARN} successful simulations, got {self.succeeded} of "
                f"{self.told} told; tell more{self.history.last_error}"
            )
        started = time.perf_counter()
        learn = in_float64(self.family.learn)
        fitted = checked_surrogate(learn(self._training_data(), self._words()), self.family)
        self._seconds += time.perf_counter() - started
        made = Fit(
            prior=self.prior,
            observed=self.observed,
            history=self.history,
            learned=fitted,
            training_mask=self._training_mask,
            settings=self.settings,
            seconds={"simulator": 0.0, **measured, "engine": self._seconds},
            before=self._before,
            made_by=self.recipe,
        )
        if warn:
            complain(made.warnings, stacklevel + 1)
        return made


def _located(measured: Measured, theta: Mapping[str, np.ndarray], seeds: np.ndarray) -> Measured:
    """The same, each failure naming its run: theta (name -> [n]) and seeds [n]."""

    def run(i: int) -> str:
        point = {name: float(column[i]) for name, column in theta.items()}
        return f"{point}" if seeds[i] == UNKNOWN else f"{point}, seed {seeds[i]}"

    errors = [
        error and replace(error, text=f"{error.text} of {run(i)}")
        for i, error in enumerate(measured.errors)
    ]
    return measured._replace(errors=errors)
