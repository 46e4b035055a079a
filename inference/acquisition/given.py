"""The acquisition that a user gives, and what it chooses."""

from typing import Any, cast

import numpy as np

from ..arguments import check_called, checked_array
from ..surrogates.base import Acquisition, Family
from .rules import RULES, LowerConfidenceBound

DIGITS, EDGE = 7, 1e-7  # of the prior quantiles that are asked, and how near the bounds


def resolve_acquisition(given: str | Acquisition | None, family: Family) -> Acquisition:
    """The acquisition that a user means.

    Args:
        given: As in `Bolfi`; None is the family's own.
        family: Of the surrogates by which it will choose.

    Raises:
        ValueError: an unknown name, nothing that can be called as an acquisition is, or "lcb"
            for surrogates without a lower bound.
    """
    acquisition: Any = family.acquisition if given is None else given
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
    check_called("acquisition", acquisition, "key", "surrogate", "n")
    if isinstance(acquisition, LowerConfidenceBound) and not family.has_lower_bound:
        others = tuple(name for name in RULES if name != "lcb")
        raise ValueError(
            "the acquisition 'lcb' needs surrogate='discrepancy', or another that has a lower "
            f"bound, got {family!r:.100}; use one of {others}"
        )
    return cast(Acquisition, acquisition)


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
