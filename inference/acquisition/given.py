"""The acquisition that a user gives, and what it chooses."""

from inspect import signature
from typing import Any, cast

import numpy as np

from ..arguments import checked_array
from ..surrogates.base import Acquisition
from .rules import RULES, LowerConfidenceBound

DIGITS, EDGE = 7, 1e-7  # of the prior quantiles that are asked, and how near the bounds


def resolve_acquisition(given: str | Acquisition | None, family: str, best: str) -> Acquisition:
    """The acquisition that a user means.

    Args:
        given: As in `Bolfi`.
        family: The surrogate's name.
        best: The name that None stands for.

    Raises:
        ValueError: an unknown name, nothing that can be called as an acquisition is, or "lcb"
            for another surrogate than the one that it is made for.
    """
    acquisition: Any = best if given is None else given
    if isinstance(acquisition, str):
        if acquisition not in RULES:
            raise ValueError(
                f"acquisition must be one of {tuple(RULES)}, an object or None, got {acquisition!r}"
            )
        acquisition = RULES[acquisition]()
    if not callable(acquisition) or isinstance(acquisition, type):
        raise ValueError(
            f"acquisition must be a name or an object to be called, got {acquisition!r:.100}"
        )
    _check_called(acquisition)
    if isinstance(acquisition, LowerConfidenceBound) and family != "discrepancy":
        raise ValueError(
            f"the acquisition 'lcb' needs surrogate='discrepancy', got {family!r}; use one "
            f"of {tuple(name for name in RULES if name != 'lcb')}"
        )
    return cast(Acquisition, acquisition)


def _check_called(acquisition: Any) -> None:
    try:
        called = signature(acquisition)
    except (TypeError, ValueError):  # of compiled code
        return
    try:
        called.bind(None, None, None)
    except TypeError as error:
        raise ValueError(
            "acquisition must be called with (key, surrogate, n), got "
            f"{acquisition!r:.100}, which is called with {called}"
        ) from error


def chosen(u: object, shape: tuple[int, int]) -> np.ndarray:
    """The points to ask for, prior quantiles float64 [n, d], from what an acquisition returned.

    They are coarser than rounding errors, so that another processor asks for the same.

    Raises:
        ValueError: of another shape, or not prior quantiles.
    """
    points = checked_array("what acquisition returns", u)
    if points.shape != shape:
        raise ValueError(
            f"acquisition must return u of shape {shape}, prior quantiles of {shape[0]} points, "
            f"got {points.shape}"
        )
    if not ((points >= -EDGE) & (points <= 1.0 + EDGE)).all():  # NaN is neither
        raise ValueError(f"acquisition must return prior quantiles from 0 to 1, got {points}")
    return np.clip(np.round(points, DIGITS), EDGE, 1.0 - EDGE)
