"""The value that ask and tell pass on: all that a run has asked and was told."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .simulations.failures import Failure, FailureKind, count, not_finite
from .simulations.returned import commonest

UNKNOWN = -1  # seed or round of a simulation made elsewhere


class History(NamedTuple):
    """Simulations told, n rows in the order of telling; arrays are never written to."""

    theta: np.ndarray  # [n, d], natural units
    u: np.ndarray  # [n, d], prior quantiles
    outputs: tuple[np.ndarray | None, ...]  # n signals of any shapes; None where there is none
    features: np.ndarray  # [n, m], what the surrogate learns of the signals besides
    discrepancy: np.ndarray  # [n], NaN where failed
    seeds: np.ndarray  # int64 [n]
    rounds: np.ndarray  # int64 [n]
    why: np.ndarray  # object [n], the Failure of a run; None where it succeeded
    observed_shape: tuple[int, ...]

    @property
    def signal_shape(self) -> tuple[int, ...]:
        """The commonest of a signal, or that of what was observed where there is none.

        A user's discrepancy may compare unlike shapes. What is concluded must not depend on which
        of them came first.
        """
        found = commonest([output.shape for output in self.outputs if output is not None])
        return self.observed_shape if found is None else found

    @property
    def signals(self) -> np.ndarray:
        """[n, *signal_shape], NaN where a run failed or its signal has another shape."""
        rows = np.full((len(self.outputs), *(shape := self.signal_shape)), np.nan)
        for row, output in enumerate(self.outputs):
            if output is not None and output.shape == shape:
                rows[row] = output
        return rows

    def signal(self, row: int) -> np.ndarray:
        """The signal of one run, of whatever shape; NaN where it failed."""
        output = self.outputs[row]
        return np.full(self.signal_shape, np.nan) if output is None else output

    @property
    def succeeded(self) -> np.ndarray:
        return np.isfinite(self.discrepancy)

    @property
    def distinct(self) -> np.ndarray:
        """Which succeeded and copy no run before, in theta, seed and signal: a copy tells nothing
        new."""
        distinct, seen = self.succeeded, set()
        for i in np.flatnonzero(distinct & (self.seeds != UNKNOWN)).tolist():
            run = *self._run(i), np.asarray(self.outputs[i]).tobytes()
            distinct[i] = run not in seen
            seen.add(run)
        return distinct

    @property
    def contradicting(self) -> int:
        """Runs that succeeded and whose signal differs from that of a run before, of the same theta
        and seed."""
        rows = np.flatnonzero(self.distinct & (self.seeds != UNKNOWN)).tolist()
        return len(rows) - len({self._run(i) for i in rows})

    def _run(self, row: int) -> tuple[bytes, int]:
        """Theta and seed of a run, which should determine its signal."""
        return self.theta[row].tobytes(), int(self.seeds[row])

    @property
    def errors(self) -> np.ndarray:
        """Why a run failed, in words, str [n]; "" where it succeeded."""
        return np.array(["" if one is None else str(one) for one in self.why], str)

    @property
    def last_error(self) -> str:
        """Why the last of the failed runs failed, as the end of a message; "" where none did."""
        failed = [failure for failure in self.why if failure is not None]
        return f"; the last error: {failed[-1]}" if failed else ""

    @property
    def failures(self) -> dict[str, int]:
        """Failed runs by `FailureKind`."""
        return count(self.why)


class State(NamedTuple):
    history: History
    pending: np.ndarray  # [m, d], theta asked and not yet told
    pending_rounds: np.ndarray  # int64 [m]
    designed: int  # points of the start design's sequence already asked
    asked: int  # points asked in all
    rounds: int  # calls of ask


def init(dimension: int, observed_shape: tuple[int, ...], features: np.ndarray) -> State:
    """Nothing asked, nothing told: `features` [0, m]."""
    rows, none = np.zeros((0, dimension)), np.zeros(0, np.int64)
    history = History(
        theta=rows,
        u=rows,
        outputs=(),
        features=features,
        discrepancy=np.zeros(0),
        seeds=none,
        rounds=none,
        why=np.zeros(0, object),
        observed_shape=observed_shape,
    )
    return State(history, rows, none, designed=0, asked=0, rounds=0)


def remember_asked(state: State, theta: np.ndarray, designed: int) -> State:
    """The state after asking theta [n, d], of which `designed` came from the start design."""
    n = len(theta)
    return state._replace(
        pending=np.concatenate([state.pending, theta]),
        pending_rounds=np.append(state.pending_rounds, np.full(n, state.rounds)),
        designed=state.designed + designed,
        asked=state.asked + n,
        rounds=state.rounds + 1,
    )


def remember_told(state: State, told: History) -> State:
    """The state after telling rows, of which each settles at most one pending point.

    Rows that were never asked are simulations made elsewhere and welcome; the rounds in
    `told` are replaced by those in which its points were asked.
    """
    pending, pending_rounds = state.pending, state.pending_rounds
    rounds = np.full(len(told.theta), UNKNOWN)
    for row, theta in enumerate(told.theta):
        matches = np.flatnonzero((pending == theta).all(-1))
        if matches.size:
            rounds[row] = pending_rounds[matches[0]]
            pending = np.delete(pending, matches[0], axis=0)
            pending_rounds = np.delete(pending_rounds, matches[0])
    merged = _merged(state.history, told._replace(rounds=rounds))
    return state._replace(history=merged, pending=pending, pending_rounds=pending_rounds)


def _merged(old: History, new: History) -> History:
    arrays = set(History._fields) - {"outputs", "observed_shape"}
    columns = {name: np.concatenate([getattr(old, name), getattr(new, name)]) for name in arrays}
    return old._replace(**columns, outputs=old.outputs + new.outputs)


def outputs_of(signals: Sequence[np.ndarray | None]) -> tuple[np.ndarray | None, ...]:
    """The same, None where a signal is NaN throughout, the mark of a failed run."""
    return tuple(
        None if signal is None or (signal.size and np.isnan(signal).all()) else signal
        for signal in signals
    )


def explain(
    signals: Sequence[np.ndarray | None],
    discrepancy: np.ndarray,
    known: Sequence[Failure | None],
) -> np.ndarray:
    """The Failure of each run, object [n]: what is known [n], else what is not finite; None where
    the discrepancy is finite."""
    why = np.full(len(signals), None)
    for i in np.flatnonzero(~np.isfinite(discrepancy)).tolist():
        signal = signals[i]
        finite = signal is not None and bool(np.isfinite(signal).all())
        why[i] = known[i] or not_finite("the discrepancy" if finite else "the signal")
    return why


def told_seeds(seeds: ArrayLike | None, n: int) -> np.ndarray:
    """Seeds of n runs that a user tells, int64 [n]; UNKNOWN where there are none.

    Raises:
        ValueError: not n integers below 2^63.
    """
    if seeds is None:
        return np.full(n, UNKNOWN)
    refusal = f"seeds must be integers below 2^63, got {seeds!r:.100}"
    try:
        array = np.ma.asarray(seeds)
        array = array.astype(np.int64) if array.size == 0 else array  # those of [] are floats
    except (TypeError, ValueError) as error:
        raise ValueError(refusal) from error
    if array.shape != (n,):
        raise ValueError(
            f"seeds must have shape ({n},), one per theta, got {array.shape}: {seeds!r:.100}"
        )
    if np.ma.is_masked(array):
        raise ValueError(f"seeds must not be masked, got {seeds!r:.100}; leave those runs out")
    # a float would lose its fraction, or as a large number its last digits
    if array.dtype.kind not in "iu" or (array > np.iinfo(np.int64).max).any():
        raise ValueError(refusal)
    return np.ma.getdata(array).astype(np.int64)


def told_errors(
    errors: Sequence[str | Failure | None] | None, succeeded: np.ndarray
) -> list[Failure | None]:
    """The failures of n runs that a user tells.

    Args:
        errors: As told; a text counts as what was raised, "" and None are no failure.
        succeeded: Whether each run left a signal that can be learned from, bool [n].

    Raises:
        ValueError: not n texts, or one for a run that succeeded.
    """
    n = len(succeeded)
    given = np.full(n, None) if errors is None else np.asarray(errors, object)
    if given.shape != (n,):
        raise ValueError(
            f"errors must have shape ({n},), one per theta, got {given.shape}: {errors!r:.100}"
        )
    told = [_failure(one) for one in given]
    for run in np.flatnonzero(succeeded):
        if told[run] is not None:
            raise ValueError(
                f"errors[{run}] is {str(told[run])!r:.100}, but the signal of that run is finite: "
                'tell NaN in its place if the run failed, or the error ""'
            )
    return told


def _failure(told: object) -> Failure | None:
    if told is None or isinstance(told, Failure):
        return told
    return Failure(FailureKind.RAISED, str(told)) if str(told) else None
