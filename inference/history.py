"""Simulations that were told, and the reading of what a user tells."""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .arguments import LARGEST_INT64, Unusable, checked_integer, float64, require
from .simulations.failures import Failure, FailureKind, unusable
from .simulations.job import commonest, signals_of

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
        new. Without a seed a copy cannot be told from a repeated run, and counts as one."""
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

    def first(self, n: int) -> "History":
        """The first n simulations."""
        kept = {name: part[:n] for name, part in self._asdict().items() if name != "observed_shape"}
        return self._replace(**kept)

    def and_then(self, later: "History") -> "History":
        """These simulations and later ones."""
        arrays = set(self._fields) - {"outputs", "observed_shape"}
        joined = {
            name: np.concatenate([getattr(self, name), getattr(later, name)]) for name in arrays
        }
        return self._replace(**joined, outputs=self.outputs + later.outputs)

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
        return dict(Counter(one.kind.value for one in self.why if one is not None))


def told_signals(
    given: object, n: int, shape: tuple[int, ...] | None
) -> tuple[tuple[np.ndarray | None, ...], list[Failure | None]]:
    """n signals that a user tells, and why some are none.

    Args:
        given: An array, or a sequence of n signals, of which some may be bad.
        n: Signals that are due.
        shape: Of one signal; None accepts any, also one of each.

    Returns:
        Signals of float64, read-only; None where something else came, and where one is NaN
        throughout, the mark of a failed run. And the failures where something else came.

    Raises:
        ValueError: not n signals, or none of them can be used.
    """
    due = "an array of numbers" if shape is None else shape
    try:
        told: list[np.ndarray | str] = list(signals_of(given, n, shape))
    except Unusable as error:
        if (error.shape or ())[:1] == (n,) == (0,):  # an empty list says nothing of a signal
            return (), []
        if isinstance(given, np.ndarray) and given.dtype == object and given.ndim == 1:
            given = given.tolist()
        listed = given if isinstance(given, list | tuple) and len(given) == n else []
        told = [_signal_or_fault(row, shape) for row in listed]
        if all(isinstance(one, str) for one in told):
            rows = f"({n}, ...)" if shape is None else (n, *shape)
            got = f"{given!r:.100}" if error.shape is None else error.shape
            raise ValueError(
                f"signals must be numbers of shape {rows}, one row per theta, got {got}"
            ) from error
    faults = [
        unusable(f"{one} was told, {due} is due") if isinstance(one, str) else None for one in told
    ]
    return tuple(map(_kept, told)), faults


def _signal_or_fault(given: object, due: tuple[int, ...] | None) -> np.ndarray | str:
    try:
        row = float64(given)
    except Unusable as bad:
        return bad.got
    return row if due in (None, row.shape) else str(row.shape)


def _kept(told: np.ndarray | str) -> np.ndarray | None:
    if isinstance(told, str) or (told.size and np.isnan(told).all()):
        return None
    told = np.asarray(told).view()
    told.flags.writeable = False
    return told


def told_seeds(seeds: ArrayLike | None, n: int) -> np.ndarray:
    """Seeds of n runs that a user tells, int64 [n]; UNKNOWN where there are none.

    Raises:
        ValueError: not n integers below 2^63.
    """
    if seeds is None:
        return np.full(n, UNKNOWN)
    given = np.ma.asarray(seeds, object)
    _check_one_per_theta("seeds", seeds, given, n)
    if np.ma.is_masked(given):
        raise ValueError(f"seeds must not be masked, got {seeds!r:.100}; leave those runs out")
    whole = [
        checked_integer(f"seeds[{run}]", seed, -LARGEST_INT64 - 1, LARGEST_INT64)
        for run, seed in enumerate(given)
    ]
    return np.array(whole, np.int64)


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
    _check_one_per_theta("errors", errors, given, n)
    told = list(map(_failure, given))
    due = "be empty, for the signal of that run is finite"
    for run in np.flatnonzero(succeeded):
        cure = 'tell NaN in its place if the run failed, or the error ""'
        require(told[run] is None, f"errors[{run}]", due, told[run], cure=cure)
    return told


def _check_one_per_theta(name: str, told: object, given: np.ndarray, n: int) -> None:
    if given.shape != (n,):
        raise ValueError(
            f"{name} must have shape ({n},), one per theta, got {given.shape}: {told!r:.100}"
        )


def _failure(told: object) -> Failure | None:
    if told is None or isinstance(told, Failure):
        return told
    return Failure(FailureKind.RAISED, str(told)) if str(told) else None
