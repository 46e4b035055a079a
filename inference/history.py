"""The value that ask and tell pass on: all that a run has asked and was told."""

from typing import NamedTuple

import numpy as np

from .simulations.failures import count, not_finite

UNKNOWN = -1  # seed or round of a simulation made elsewhere


class History(NamedTuple):
    """Simulations told, n rows in the order of telling; arrays are never written to."""

    theta: np.ndarray  # [n, d], natural units
    u: np.ndarray  # [n, d], prior quantiles
    signals: np.ndarray  # [n, *signal_shape]
    features: np.ndarray  # [n, m], what the surrogate learns of the signals besides
    discrepancy: np.ndarray  # [n], NaN where failed
    seeds: np.ndarray  # int64 [n]
    rounds: np.ndarray  # int64 [n]
    errors: np.ndarray  # str [n], why a run failed; "" where it succeeded

    @property
    def succeeded(self) -> np.ndarray:
        return np.isfinite(self.discrepancy)

    @property
    def distinct(self) -> np.ndarray:
        """Which succeeded and copy no run before: one of equal theta and seed tells nothing new."""
        distinct, seen = self.succeeded, set()
        for i in np.flatnonzero(distinct & (self.seeds != UNKNOWN)):
            run = self.theta[i].tobytes(), int(self.seeds[i])
            distinct[i] = run not in seen
            seen.add(run)
        return distinct

    @property
    def failures(self) -> dict[str, int]:
        """Failed runs by kind: "raised", "not finite", "timeout", "unusable"."""
        return count(self.errors)


class State(NamedTuple):
    history: History
    pending: np.ndarray  # [m, d], theta asked and not yet told
    pending_rounds: np.ndarray  # int64 [m]
    designed: int  # points of the start design's sequence already asked
    asked: int  # points asked in all
    rounds: int  # calls of ask


def init(dimension: int, signal_shape: tuple[int, ...], features: int) -> State:
    """Nothing asked, nothing told."""
    rows, none = np.zeros((0, dimension)), np.zeros(0, np.int64)
    history = History(
        theta=rows,
        u=rows,
        signals=np.zeros((0, *signal_shape)),
        features=np.zeros((0, features)),
        discrepancy=np.zeros(0),
        seeds=none,
        rounds=none,
        errors=np.zeros(0, str),
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
    old, new = state.history, told._replace(rounds=rounds)
    if np.isnan(old.signals).all():  # only failed runs so far: the first signals fix the shape
        old = old._replace(signals=np.full((len(old.theta), *new.signals.shape[1:]), np.nan))
    merged = History(*(np.concatenate(pair) for pair in zip(old, new, strict=True)))
    return state._replace(history=merged, pending=pending, pending_rounds=pending_rounds)


def explain(signals: np.ndarray, discrepancy: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Why each run failed, str [n]: `errors` [n] where it says so, else what is not finite."""
    finite = np.isfinite(signals.reshape(len(signals), -1)).all(1)
    found = np.where(finite, not_finite("the discrepancy"), not_finite("the signal"))
    return np.where(np.isfinite(discrepancy), "", np.where(errors == "", found, errors))
