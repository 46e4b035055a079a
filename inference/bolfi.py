"""Ask and tell: Bayesian optimisation for likelihood-free inference, one step at a time."""

import time
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, cast

import jax
import numpy as np
from numpy.typing import ArrayLike

from ._float64 import in_float64
from .acquisition import rules as acquisitions
from .acquisition.replicates import next_replicate
from .arguments import Unusable, checked_array, checked_integer
from .describe import describe
from .gp.process import padded_rows
from .history import (
    UNKNOWN,
    History,
    explain,
    init,
    remember_asked,
    remember_told,
)
from .notebook_display import as_html, as_text
from .prior import Prior
from .result import Fit
from .simulations.failures import unusable
from .simulations.returned import told_signals
from .sobol import sobol, start_size
from .surrogates.base import Acquisition
from .surrogates.families import Family, Learnable, resolve
from .surrogates.feasibility import feasibility
from .surrogates.outliers import sane
from .surrogates.warnings import EmulatorWarning
from .types import Theta

ASKED_DIGITS, ASKED_EDGE = 7, 1e-7  # of the prior quantiles that are asked, and how near the bounds
MIN_LEARN = 3  # successful simulations before the surrogate may choose


class Bolfi:
    """The engine between a prior and a simulator that somebody else runs.

    What is asked depends only on `seed` and on the calls of `ask` and `tell` before, so a run
    that is repeated from its stored simulations goes on as if it had never stopped.

    Args:
        prior: The parameters and their priors.
        observed: The measured output [*signal_shape], time first; NaN is a missing sample.
        surrogate: "signal", which emulates the output; "discrepancy", the paper's; a
            `SignalFamily` or `DiscrepancyFamily`; None is "signal", unless a discrepancy, or
            another option of that family alone, is given.
        acquisition: "eiv", "maxvar", "draws", "lcb" (with "discrepancy"), an object (see
            `Acquisition`), or None for the surrogate's best.
        seed: Fixes the start design and the acquisitions.
        initial: Points of the Sobol start design; None is 2 d + 6.
        capacity: Simulations for which arrays are reserved, rounded up to a power of two; up
            to there nothing is compiled anew. Small ones are faster, larger runs double it.
        options: Of the surrogate's family: `summary`, `noise`, `components`, `predicted` and
            `discrepancy` of "signal"; `discrepancy`, `transform`, `threshold` and `hyper_draws`
            of "discrepancy".

    Raises:
        ValueError: an argument is not one of the above.
    """

    def __init__(  # noqa: PLR0913  one flat place for what defines a run
        self,
        prior: Prior,
        observed: ArrayLike,
        *,
        surrogate: str | Family | None = None,
        acquisition: str | Acquisition | None = None,
        seed: int = 0,
        initial: int | None = None,
        capacity: int = 256,
        **options: Any,
    ):
        if not isinstance(prior, Prior):
            raise ValueError(
                f"prior must be a Prior, got {type(prior).__name__}; "
                "make one of name -> distribution by inference.Prior({...})"
            )
        self.prior = prior
        self.observed = checked_array("observed", observed)
        if np.isinf(self.observed).any():
            raise ValueError("observed must not be infinite; NaN is a missing sample")
        self.seed = checked_integer("seed", seed, 0)
        self.initial = checked_integer(
            "initial", start_size(len(prior)) if initial is None else initial, MIN_LEARN
        )
        self.capacity = checked_integer("capacity", capacity)
        self.family = resolve(surrogate, options)
        self._learner = self.family.learner(self.observed)
        self._acquire = _resolve(acquisition, self.family)
        # a user's own function may compare unlike shapes
        self._any_shape = self._learner.any_shape
        self.settings: dict[str, object] = {
            "surrogate": self.family.name,
            **{name: describe(value) for name, value in vars(self.family).items()},
            "acquisition": describe(self._acquire),
            "seed": self.seed,
            "initial": self.initial,
        }
        self._state = init(len(prior), self.observed.shape, self._learner.features)
        self._learned: Any = None  # the family's surrogate, once there is one
        self._seconds = 0.0

    def __repr__(self) -> str:
        return as_text("Bolfi", self._shown())

    def _repr_html_(self) -> str:
        return as_html("Bolfi", self._shown())

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
        return len(self._state.history.theta)

    @property
    def succeeded(self) -> int:
        """Simulations told so far that gave a finite discrepancy, copies counted once."""
        return int(self._state.history.distinct.sum())

    @property
    def errors(self) -> list[str]:
        """Why simulations failed, in the order told."""
        return [str(error) for error in self._state.history.errors if error]

    @property
    def signal_shape(self) -> tuple[int, ...]:
        """Shape of one simulated signal: that of `observed`, or of the signals told so far."""
        return self._state.history.signals.shape[1:]

    @property
    def expected_shape(self) -> tuple[int, ...] | None:
        """`signal_shape`; None while a user's discrepancy leaves it to the first signals."""
        free = self._any_shape and np.isnan(self._state.history.signals).all()
        return None if free else self.signal_shape

    def ask(self, n: int = 1) -> dict[str, np.ndarray]:
        """The next n different points to simulate, name -> [n].

        Start-design points first, and for as long as fewer than three simulations have
        succeeded; then the acquisition's, which take everything pending into account.

        Raises:
            ValueError: n < 1.
        """
        n = checked_integer("n", n)
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

    def _designed_now(self, n: int) -> int:
        """How many of the next n points the start design provides."""
        if self.succeeded < MIN_LEARN:
            return n
        covered = self.succeeded + len(self._state.pending)
        return min(n, max(0, self.initial - covered))

    def _acquired(self, n: int, designed: np.ndarray) -> np.ndarray:
        """theta [n, d] of the engine's choice, `designed` [m, d] being asked with them."""
        history = self._state.history
        pending = np.concatenate([self._state.pending, designed])
        rows = self._rows(len(pending) + n)
        self._learned = self._learner.learn(self._known(), rows, self._learned)
        repeated = next_replicate(history, pending) if self.family.replicates else None
        parts = [] if repeated is None else [repeated[None]]
        if n > len(parts):
            runs = feasibility(history.u, history.succeeded & sane(history.discrepancy), rows)
            key = jax.random.fold_in(jax.random.key(self.seed), self._state.asked)
            believing = self._learned.believe(self.prior.to_unit(self.prior.to_dict(pending)))
            u = np.asarray(in_float64(self._acquire)(key, believing, n - len(parts), runs))
            # coarser than rounding errors, so that arrays of another size ask the same
            u = np.clip(np.round(u, ASKED_DIGITS), ASKED_EDGE, 1.0 - ASKED_EDGE)
            parts.append(self.prior.to_array(self.prior.from_unit(u)))
        return np.concatenate(parts)

    def _known(self) -> Learnable:
        history = self._state.history
        good = history.distinct
        known = history.u[good], history.features[good], history.discrepancy[good]
        return Learnable(*known, self.prior.normal)

    def _rows(self, extra: int) -> int:
        """Rows of the arrays for what was told and `extra` more."""
        return padded_rows(max(self.capacity, self.told + extra))

    def tell(
        self,
        theta: Theta,
        signals: ArrayLike,
        seeds: ArrayLike | None = None,
        errors: Sequence[str] | None = None,
    ) -> None:
        """Give the engine finished simulations: any number, any order, asked for or not.

        A row of NaN reports a failed run. It counts as told, but nothing is learned from it. So
        does whatever is no signal among a list or tuple of signals.

        Args:
            theta: Name -> [n], in the prior's support.
            signals: [n, *signal_shape], or a list of n signals.
            seeds: Seeds of the runs [n], to be kept with the results. Of runs with equal theta
                and seed one is learned from.
            errors: Why a run failed [n], to be kept for rows of NaN; "" elsewhere.

        Raises:
            ValueError: shapes disagree, or theta lies outside the prior's support.
        """
        started = time.perf_counter()
        natural = np.atleast_2d(self.prior.to_array(theta))
        rows = self.prior.to_dict(natural)
        signals, faults = self._signals(len(natural), signals)
        outside = np.flatnonzero(~self.prior.contains(rows))
        if outside.size:
            first = {name: float(column[outside[0]]) for name, column in rows.items()}
            raise ValueError(f"theta must lie in the support of the prior, got {first}")
        given_errors = _errors(errors, len(natural))
        features, discrepancy = self._learner.measure(signals)
        told = History(
            theta=natural,
            u=self.prior.to_unit(rows),
            signals=signals,
            features=features,
            discrepancy=discrepancy,
            seeds=_seeds(seeds, len(natural)),
            rounds=np.full(len(natural), UNKNOWN),
            errors=explain(signals, discrepancy, np.where(faults == "", given_errors, faults)),
        )
        self._state = remember_told(self._state, told)
        self._seconds += time.perf_counter() - started

    def _signals(self, n: int, signals: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Signals [n, *signal_shape] as told, and what was told in the place of each, str [n]."""
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
        told = [
            fault and unusable(f"{fault} was told, {rows.shape[1:]} is due") for fault in faults
        ]
        return rows, np.array(told, str)

    def fit(
        self,
        seconds: Mapping[str, float] | None = None,
        *,
        warn: bool = True,
        stacklevel: int = 2,
    ) -> Fit:
        """What can be concluded from the simulations told so far.

        Args:
            seconds: Times that the caller measured (such as the simulator's), to be kept.
            warn: Whether each of the surrogate's complaints is raised as a warning.
            stacklevel: Of the warnings; 2 blames the line that calls this.

        Raises:
            ValueError: fewer than three simulations succeeded.

        Warns:
            EmulatorWarning: for each of the surrogate's complaints, unless warn=False; they are
                in `Fit.warnings` in any case.
        """
        if self.succeeded < MIN_LEARN:
            raise ValueError(
                f"a fit needs {MIN_LEARN} successful simulations, got {self.succeeded} of "
                f"{self.told} told; tell more"
            )
        started = time.perf_counter()
        known, history = self._known(), self._state.history
        fitted = self._learner.finish(known, self._rows(0), self.seed)
        learned_from = history.distinct
        learned_from[learned_from] = self._learner.learnable(known.discrepancy)
        spent = self._seconds + time.perf_counter() - started
        made = Fit(
            prior=self.prior,
            observed=self.observed,
            history=history,
            learned=fitted,
            learned_from=learned_from,
            settings=self.settings,
            seconds={"simulator": 0.0, **(seconds or {}), "engine": spent},
        )
        for complaint in made.warnings if warn else []:
            warnings.warn(complaint, EmulatorWarning, stacklevel=stacklevel)
        return made


def _resolve(given: str | Acquisition | None, family: Family) -> Acquisition:
    acquisition: Any = family.acquisition if given is None else given
    if isinstance(acquisition, str):
        if acquisition not in acquisitions.RULES:
            raise ValueError(
                f"acquisition must be one of {tuple(acquisitions.RULES)}, an object or None, "
                f"got {acquisition!r}"
            )
        acquisition = acquisitions.RULES[acquisition]()
    if not callable(acquisition) or isinstance(acquisition, type):
        raise ValueError(
            f"acquisition must be a name or an object to be called, got {acquisition!r:.100}"
        )
    bound = isinstance(acquisition, acquisitions.LowerConfidenceBound)
    if bound and family.name != "discrepancy":
        raise ValueError(
            f"the acquisition 'lcb' needs surrogate='discrepancy', got {family.name!r}; use one "
            f"of {tuple(name for name in acquisitions.RULES if name != 'lcb')}"
        )
    return cast(Acquisition, acquisition)


def _seeds(seeds: ArrayLike | None, n: int) -> np.ndarray:
    if seeds is None:
        return np.full(n, UNKNOWN)
    refusal = f"seeds must be integers below 2^63, got {seeds!r:.100}"
    try:
        array = np.asarray(seeds)
    except (TypeError, ValueError) as error:
        raise ValueError(refusal) from error
    if array.shape != (n,):
        raise ValueError(f"seeds must have shape ({n},), one per theta, got {array.shape}")
    # a float would lose its fraction, or as a large number its last digits
    if array.dtype.kind not in "iu" or (array > np.iinfo(np.int64).max).any():
        raise ValueError(refusal)
    return array.astype(np.int64)


def _errors(errors: Sequence[str] | None, n: int) -> np.ndarray:
    array = np.full(n, "") if errors is None else np.asarray(errors, str)
    if array.shape != (n,):
        raise ValueError(f"errors must have shape ({n},), one per theta, got {array.shape}")
    return array
