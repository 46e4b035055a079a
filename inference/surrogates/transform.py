"""Monotone transforms of the discrepancy on which the surrogate is learned."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

ROUNDING = 1e-9  # of the largest discrepancy, below which differences tell nothing
NEAR_SHARE = 0.25  # of the runs, to which a logarithm may be linear


class Transform(NamedTuple):
    """g(Delta + offset); an offset is where a zero would break the log or the Jacobian, or where
    the logarithm shall resolve the least discrepancies, whatever their sign."""

    name: str
    offset: float
    signed: bool = False

    def __call__(self, discrepancy: np.ndarray) -> np.ndarray:
        return TRANSFORMS[self.name][0](np.asarray(discrepancy) + self.offset)

    def inverse(self, value: np.ndarray) -> np.ndarray:
        """Delta where g(Delta + offset) = value; 0 where that would be negative, unless some
        discrepancies are."""
        if self.name == "identity":
            return np.asarray(value)
        raw = np.exp(value) if self.name == "log" else np.maximum(value, 0.0) ** 2
        return raw - self.offset if self.signed else np.maximum(raw - self.offset, 0.0)

    def log_jacobian(self, discrepancy: np.ndarray) -> np.ndarray:
        """log |dg / dDelta|."""
        return TRANSFORMS[self.name][1](np.asarray(discrepancy) + self.offset)


Function = Callable[[np.ndarray], np.ndarray]
TRANSFORMS: dict[str, tuple[Function, Function]] = {
    "identity": (lambda x: x, np.zeros_like),
    "sqrt": (np.sqrt, lambda x: -np.log(2.0) - 0.5 * np.log(x)),
    "log": (np.log, lambda x: -np.log(x)),
}


def check_transform(name: object) -> None:
    """Raise ValueError unless `name` is one of TRANSFORMS or None."""
    if name is not None and name not in tuple(TRANSFORMS):
        raise ValueError(f"transform must be one of {tuple(TRANSFORMS)} or None, got {name!r:.100}")


def candidates(name: str | None, discrepancy: np.ndarray) -> list[Transform]:
    """The transforms that `discrepancy` admits.

    Args:
        name: One of TRANSFORMS, or None for all that apply, and a logarithm that is linear among
            the least discrepancies, which adapts as the search closes in.
        discrepancy: Finite values [n].

    Raises:
        ValueError: sqrt or log of negative discrepancies.
    """
    lowest = discrepancy.min()
    if lowest < 0 and name not in (None, "identity"):
        raise ValueError(
            f"transform {name!r} needs discrepancies >= 0, got {lowest:.3g}; use 'identity'"
        )
    names = ("identity",) if lowest < 0 else tuple(TRANSFORMS) if name is None else (name,)
    found = [Transform(n, 0.0 if n == "identity" else _offset(discrepancy)) for n in names]
    near = float(np.quantile(discrepancy, NEAR_SHARE)) - lowest
    if name is not None or near <= ROUNDING * np.abs(discrepancy).max():
        return found
    return [*found, Transform("log", near - lowest, bool(lowest < 0))]


def _offset(discrepancy: np.ndarray) -> float:
    """Half the smallest positive discrepancy if some are zero, else 0."""
    if discrepancy.min() > 0:
        return 0.0
    positive = discrepancy[discrepancy > 0]
    return float(positive.min()) / 2 if positive.size else 1.0
