"""When enough has been simulated."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .arguments import check_callable, checked_integer, checked_number, require
from .bolfi import MIN_LEARN, MOST_SIMULATIONS, Bolfi
from .result import Fit

EVERY = 5  # simulations between two looks
IN_A_ROW = 2  # looks at which the error must be below the tolerance


@dataclass(frozen=True)
class Until:
    """A budget of `fit` that ends when the posterior is known well enough.

    That is looked at after the start design, every fifth simulation, and must be so twice in a row:
    the first time may be luck. A fit with warnings goes on to `most` simulations.

    Attributes:
        tolerance: Of the error.
        most: Simulations, those at draws of the posterior not counted.
        error: What shall be below the tolerance, from a fit: None is `Fit.interval_error`; or the
            expected regret of what is to be decided, in its own units.

    Raises:
        ValueError: a tolerance that is not positive and finite, or bad numbers.
    """

    tolerance: float = 0.25
    most: int = 60
    error: Callable[[Fit], float] | None = None

    def __post_init__(self) -> None:
        due = "positive and finite"
        checked_number("tolerance", self.tolerance, lambda t: 0.0 < t < np.inf, due)
        checked_integer("most", self.most, MIN_LEARN, MOST_SIMULATIONS)
        check_callable("error", self.error)

    def _reached(self, made: Fit, kept: str) -> bool:
        """Whether a fit is known well enough and has no warnings: an emulator that predicts nothing
        has no uncertainty either. `kept` says where simulations are."""
        if self.error is None:
            return made.interval_error() <= self.tolerance and not made.warnings
        try:
            error = float(self.error(made))
        except Exception as failed:  # whatever the user's code raises
            raise ValueError(
                f"error of Until cannot be used on the fit of {len(made.history.theta)} "
                f"simulations ({type(failed).__name__}: {failed}); let it return a number, and "
                f"repeat the call. {kept}"
            ) from failed
        return error <= self.tolerance and not made.warnings


def checked_budget(budget: object, least: int) -> tuple[int, Until | None]:
    """Simulations in all, `least` at least, and when fewer are enough; None where never.

    Raises:
        ValueError: neither a number nor "auto" nor an `Until`.
    """
    until = Until() if isinstance(budget, str) and budget == "auto" else budget
    if isinstance(until, Until):
        return until.most, until
    due = f'be "auto", an Until or an integer from {least} to {MOST_SIMULATIONS}'
    require(hasattr(budget, "__index__"), "budget", due, budget)
    return checked_integer("budget", budget, least, MOST_SIMULATIONS), None


def enough(engine: Bolfi, until: Until | None, kept: str) -> Callable[[], bool]:
    """A function that says whether to stop: after the start design it looks at every fifth
    simulation. `kept` says where simulations are."""
    looked, in_a_row = engine.initial, 0

    def stop() -> bool:
        nonlocal looked, in_a_row
        early = engine.told < looked + EVERY or engine.succeeded < MIN_LEARN
        if until is None or early:
            return False
        looked = engine.told
        in_a_row = in_a_row + 1 if until._reached(engine.fit(warn=False), kept) else 0
        return in_a_row == IN_A_ROW

    return stop


def soonest(start: int, batch: int) -> int:
    """Simulations after which a search that runs in rounds may end at the earliest.

    Args:
        start: In the start design.
        batch: Made between two questions whether to stop.
    """
    for _ in range(IN_A_ROW):
        start = -(-(start + EVERY) // batch) * batch
    return start
