"""Predict the last third of the runs from the first two thirds."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from .emulator import Emulator, beyond_components, emulate, innovations, resized

FIRST_SHARE = 2.0 / 3.0  # share of the runs from which the others are predicted
# First runs: with fewer the hyperparameters are unreliable.
MIN_FIRST_RUNS = 12


class HeldBack(NamedTuple):
    """Errors of the last runs, predicted from the first ones.

    Attributes:
        errors: Studentised [n, components + 1]; the last column has the length of what no
            component can make, over the expected length. NaN where nothing was predicted: in the
            first rows, in those beyond the first ones' range, in components without use, and
            everywhere if the runs are too few.
        freedom: Degrees of freedom of the first runs.
    """

    errors: np.ndarray
    freedom: int


@in_float64
def held_back(emulator: Emulator, scale: Callable[[np.ndarray], np.ndarray]) -> HeldBack:
    """Errors of the last runs, predicted from those before them.

    Leave-one-out errors keep the components and hyperparameters that all runs gave, so they are
    too small where these overfit. An emulator learned from the first runs alone has not seen the
    last ones, which lie where the engine has searched: if its errors exceed its variance there,
    the posterior is not to be trusted. Each of the last runs is also conditioned on those before
    it, so that a shared error counts once.

    Args:
        emulator: Of all runs, in the order in which they became known.
        scale: As for `emulate`.
    """
    outputs, data = emulator.outputs, emulator.gp.data
    n, k = len(outputs), emulator.basis.vectors.shape[1]
    u, d = data.u[:n], data.u.shape[1]
    first = round(FIRST_SHARE * n)
    freedom = first - (1 + 2 * d)  # a process's trend has as many coefficients
    errors = np.full((n, k + 1), np.nan)
    low, high = u[:first].min(0), u[:first].max(0)
    within = np.all((u >= low) & (u <= high), axis=1) & (np.arange(n) >= first)
    if first < MIN_FIRST_RUNS or freedom < 1 or not within.any():
        return HeldBack(errors, freedom)
    early = emulate(u[:first], outputs[:first], scale, emulator.limits, None, data.normal)
    early = early if emulator.size is None else resized(early, scale)
    errors[within, : early.basis.used] = innovations(early, u[within], outputs[within])
    errors[within, k] = beyond_components(early, u[within], outputs[within])
    return HeldBack(errors, freedom)
