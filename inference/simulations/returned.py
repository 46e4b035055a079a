"""What a simulator returned, as signals: one border for all executors.

Loads nothing but NumPy, for workers import it.
"""

from collections.abc import Sequence

import numpy as np

from ..arguments import Unusable, float64


def signals_of(returned: object, n: int, shape: tuple[int, ...] | None) -> np.ndarray:
    """What a simulator returned for n runs: float64 [n, *shape].

    Args:
        shape: Of one signal; None accepts any.

    Raises:
        Unusable: no numbers, or of another shape.
    """
    signals = float64(returned)
    if signals.shape[:1] != (n,) or shape not in (None, signals.shape[1:]):
        raise Unusable(str(signals.shape), signals.shape)
    return signals


def told_signals(
    given: object, n: int, shape: tuple[int, ...] | None
) -> tuple[Sequence[np.ndarray | None], list[str]]:
    """Signals that a user hands over, and what is wrong with each.

    Args:
        given: An array, or a sequence of n signals, of which some may be bad.
        n: Signals that are due.
        shape: Of one signal; None accepts any, also one of each.

    Returns:
        n signals of float64, read-only, None where something else came; and what came there, ""
        elsewhere.

    Raises:
        Unusable: not n signals, or none of them can be used.
    """
    try:
        rows = signals_of(given, n, shape)
        return [_read_only(rows[i, ...]) for i in range(n)], [""] * n
    except Unusable:
        if isinstance(given, np.ndarray) and given.dtype == object and given.ndim == 1:
            given = given.tolist()
        if not isinstance(given, list | tuple) or len(given) != n:
            raise
        tried = [_signal_or_fault(row, shape) for row in given]
        if n and all(fault for _, fault in tried):
            raise
    return [row for row, _ in tried], [fault for _, fault in tried]


def _signal_or_fault(given: object, due: tuple[int, ...] | None) -> tuple[np.ndarray | None, str]:
    try:
        row = float64(given)
    except Unusable as bad:
        return None, bad.got
    return (_read_only(row), "") if due in (None, row.shape) else (None, str(row.shape))


def _read_only(array: np.ndarray) -> np.ndarray:
    seen = array.view()
    seen.flags.writeable = False
    return seen


def commonest(shapes: list[tuple[int, ...]]) -> tuple[int, ...] | None:
    """The shape that occurs most often, the first of them at a tie; None of none."""
    return max(dict.fromkeys(shapes), key=shapes.count, default=None)
