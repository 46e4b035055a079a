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
        n signals of float64, None where something else came; and what came there, "" elsewhere.

    Raises:
        Unusable: not n signals, or none of them can be used.
    """
    try:
        rows = signals_of(given, n, shape)
        return [rows[i, ...] for i in range(n)], [""] * n
    except Unusable:
        if isinstance(given, np.ndarray) and given.dtype == object and given.ndim == 1:
            given = given.tolist()
        if not isinstance(given, list | tuple) or len(given) != n:
            raise
        tried = [_float64_or_why(row) for row in given]
        faults = [_fault(row, shape) for row in tried]
        if n and all(faults):
            raise
    return [
        row if isinstance(row, np.ndarray) and not why else None
        for row, why in zip(tried, faults, strict=True)
    ], faults


def _float64_or_why(row: object) -> np.ndarray | str:
    try:
        return float64(row)
    except Unusable as bad:
        return bad.got


def _fault(row: np.ndarray | str, due: tuple[int, ...] | None) -> str:
    if isinstance(row, str):
        return row
    return "" if due in (None, row.shape) else str(row.shape)


def commonest(shapes: list[tuple[int, ...]]) -> tuple[int, ...] | None:
    """The shape that occurs most often, the first of them at a tie; None of none."""
    return max(dict.fromkeys(shapes), key=shapes.count, default=None)
