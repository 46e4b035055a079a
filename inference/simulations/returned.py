"""What a simulator returned, as signals: one border for all executors.

Loads nothing but NumPy, for workers import it.
"""

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
) -> tuple[np.ndarray, list[str]]:
    """Signals that a user hands over, and what is wrong with each.

    Args:
        given: An array, or a sequence of n signals; a bad one among good ones is a row of NaN.
        n: Signals that are due.
        shape: Of one signal; None takes the commonest.

    Returns:
        float64 [n, *shape]; and for each row what came in place of a signal, "" if one came.

    Raises:
        Unusable: not n signals, or none of them can be used.
    """
    try:
        return signals_of(given, n, shape), [""] * n
    except Unusable:
        if not isinstance(given, list | tuple) or len(given) != n:
            raise
        rows = [_float64_or_why(row) for row in given]
        shapes = [row.shape for row in rows if not isinstance(row, str)]
        due = commonest(shapes) if shape is None else shape
        faults = [_fault(row, due) for row in rows]
        if due is None or all(faults):
            raise
    missing = np.full(due, np.nan)
    return np.stack(
        [missing if why else row for row, why in zip(rows, faults, strict=True)]
    ), faults


def _float64_or_why(row: object) -> np.ndarray | str:
    try:
        return float64(row)
    except Unusable as bad:
        return bad.got


def _fault(row: np.ndarray | str, due: tuple[int, ...] | None) -> str:
    if isinstance(row, str):
        return row
    return "" if row.shape == due else str(row.shape)


def commonest(shapes: list[tuple[int, ...]]) -> tuple[int, ...] | None:
    """The shape that occurs most often, the first of them at a tie; None of none."""
    return max(dict.fromkeys(shapes), key=shapes.count, default=None)
