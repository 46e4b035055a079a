"""Whether the last simulations came out as those before them had led to expect."""

from collections.abc import Callable

import numpy as np

from ._float64 import in_float64
from .emulator import Emulator, emulate, score_errors

EARLIER = 2.0 / 3.0  # share of the runs from which the others are foretold
FEWEST = (
    12  # runs to foretell others from: fewer know little of the output, and believe in anything
)


@in_float64
def foretold_errors(
    emulator: Emulator, scale: Callable[[np.ndarray], np.ndarray], predicted: float | None
) -> np.ndarray:
    """Studentised errors [n, components] of the last runs, foretold from those before them.

    Leave-one-out errors keep the components and hyperparameters that all runs gave, so where these
    follow the runs too closely, the errors do as well. An emulator that is learned anew from the
    first runs alone has no part in the last ones, which lie where the engine has searched: there
    its errors are as large as it believes, or its posterior is not to be trusted.

    Args:
        emulator: Of all runs, in the order in which they became known.
        scale, predicted: As for `emulate`.

    Returns:
        NaN where nothing was foretold: in the first rows, in those beyond the first ones' range,
        and in all where there are too few.
    """
    outputs, data = emulator.outputs, emulator.gp.data
    n, k = len(outputs), emulator.basis.vectors.shape[1]
    u = np.asarray(data.u)[:n]
    first = round(EARLIER * n)
    errors = np.full((n, k), np.nan)
    low, high = u[:first].min(0), u[:first].max(0)
    within = np.all((u >= low) & (u <= high), axis=1) & (np.arange(n) >= first)
    if first < FEWEST or not within.any():
        return errors
    rows, normal = len(data.u), np.asarray(data.normal)
    early = emulate(u[:first], outputs[:first], scale, k, rows, None, normal, predicted)
    used = early.basis.used
    errors[within, :used] = score_errors(early, u[within], outputs[within])
    return errors
