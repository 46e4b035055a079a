"""Whether the last simulations came out as those before them had led to expect."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from .emulator import (
    Emulator,
    Limits,
    beyond_components,
    emulate,
    innovations,
)

EARLIER = 2.0 / 3.0  # share of the runs from which the others are foretold
# Runs to foretell others from: fewer know little of the output, and believe in anything.
FEWEST = 12


class Foretold(NamedTuple):
    """How far the last runs came out from where those before them had led to expect.

    Attributes:
        errors: Studentised [n, components + 1]; the last column has the length of what no
            component can make, over the expected length. NaN where nothing was foretold: in the
            first rows, in those beyond the first ones' range, in components without use, and
            everywhere if the runs are too few.
        freedom: Degrees of freedom of the first runs.
    """

    errors: np.ndarray
    freedom: int


@in_float64
def foretold(
    emulator: Emulator, scale: Callable[[np.ndarray], np.ndarray], predicted: float | None
) -> Foretold:
    """Errors of the last runs, foretold from those before them.

    Leave-one-out errors keep the components and hyperparameters that all runs gave, so where these
    follow the runs too closely, the errors do as well. An emulator that is learned anew from the
    first runs alone has no part in the last ones, which lie where the engine has searched: there
    its errors are as large as it believes, or its posterior is not to be trusted. Each of the last
    runs is also given those before it, so that what they share in error counts once.

    Args:
        emulator: Of all runs, in the order in which they became known.
        scale, predicted: As for `emulate`.
    """
    outputs, data = emulator.outputs, emulator.gp.data
    n, k = len(outputs), emulator.basis.vectors.shape[1]
    rows, d = data.u.shape
    u = np.asarray(data.u)[:n]
    first = round(EARLIER * n)
    freedom = first - (1 + 2 * d)  # a process's trend has as many coefficients
    errors = np.full((n, k + 1), np.nan)
    low, high = u[:first].min(0), u[:first].max(0)
    within = np.all((u >= low) & (u <= high), axis=1) & (np.arange(n) >= first)
    if first < FEWEST or freedom < 1 or not within.any():
        return Foretold(errors, freedom)
    normal = np.asarray(data.normal)
    early = emulate(u[:first], outputs[:first], scale, Limits(k, rows, predicted), None, normal)
    errors[within, : early.basis.used] = innovations(early, u[within], outputs[within])
    errors[within, k] = beyond_components(early, outputs[within])
    return Foretold(errors, freedom)
