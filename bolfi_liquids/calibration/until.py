"""What shall be known for a search to end before its budget."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import Argument, InputError
from ..inputs.settings import MIN_SIMULATIONS, CalibrationSettings
from ..inputs.table import parse_number

if TYPE_CHECKING:
    from ..inference import Fit, Prior
    from ..inference.simulations import Compute
    from ..simulators import StirSimulator


class Goal(NamedTuple):
    """What shall be known, and how well; see `pouring.known.known`.

    Attributes:
        text: QUANTITY=TOLERANCE, for run.toml.
        tolerance: Error at which the search ends.
        learn: Makes the error of a fit, after the pours that it rests on; the last argument is
            whether to show bars.
        scene: Everything that fixes them, for run.toml.
    """

    text: str
    tolerance: float
    learn: "Callable[[StirSimulator, Prior, Compute, bool], Callable[[Fit], float]]"
    scene: Mapping[str, Any] = {}


def parts_of(text: str) -> tuple[str, float]:
    """Quantity and tolerance of QUANTITY=TOLERANCE; NaN where that is no number."""
    quantity, _, given = (part.strip() for part in text.partition("="))
    with suppress(ValueError):
        return quantity, parse_number(given)
    return quantity, np.nan


def usual_budget(goal: object) -> int:
    """The default budget: that of the settings, or with a goal the most of an `Until`."""
    if goal is None:
        return CalibrationSettings.budget
    from ..inference import Until

    return Until.most


def check_goal(goal: object, settings: CalibrationSettings, parameters: int) -> None:
    """Refuse what is no goal, and a budget that is spent before it could end the search.

    Args:
        goal: Of a calibration; None is none.
        settings: Its others.
        parameters: Number of the prior.
    """
    from ..inference.sobol import start_size
    from ..inference.until import soonest

    if goal is None:
        return
    if not isinstance(goal, Goal):
        given = goal if isinstance(goal, str) else "spillage=0.02"
        fix = f'give bolfi_liquids.known("{given}")'
        raise InputError(f"{goal!r:.80}", where=Argument("until"), fix=fix)
    start = MIN_SIMULATIONS if settings.surrogate == "discrepancy" else start_size(parameters)
    least = soonest(start, settings.batch)
    if settings.budget <= least:
        raise InputError(
            f"{settings.budget} simulations, and `until` takes {least} at least",
            where=Argument("budget"),
            fix=f"give more than {least}, or leave `until` out",
        )
