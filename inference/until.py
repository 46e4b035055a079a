"""When enough has been simulated."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .arguments import check_callable, checked_integer, checked_number
from .bolfi import MIN_LEARN, MOST_SIMULATIONS, Bolfi
from .result import Fit

EVERY = 5  # simulations between two looks


@dataclass(frozen=True)
class Until:
    """A budget of `fit` that ends when the posterior is known well enough.

    That is looked at after the start design, every fifth simulation. What a fit warns of goes on to
    `most`.

    Attributes:
        tolerance: Of the error.
        most: Simulations in all.
        error: What shall be below the tolerance, from a fit: None is `Fit.interval_error`; or the
            expected regret of what is to be decided, in its own units.

    Raises:
        ValueError: a tolerance that is not positive, or bad numbers.
    """

    tolerance: float = 0.25
    most: int = 100
    error: Callable[[Fit], float] | None = None

    def __post_init__(self) -> None:
        checked_number("tolerance", self.tolerance, lambda t: 0.0 < t < np.inf, "positive")
        checked_integer("most", self.most, MIN_LEARN, MOST_SIMULATIONS)
        check_callable("error", self.error)

    def _reached(self, made: Fit) -> bool:
        """Whether a fit is known well enough, and nothing about it is complained of: an emulator
        that predicts nothing is sure of that."""
        error = made.interval_error() if self.error is None else float(self.error(made))
        return error <= self.tolerance and not made.warnings


def checked_budget(budget: object, least: int) -> tuple[int, Until | None]:
    """Simulations in all, `least` at least, and when fewer are enough; None where never.

    Raises:
        ValueError: neither a number nor "auto" nor an `Until`.
    """
    until = Until() if isinstance(budget, str) and budget == "auto" else budget
    if isinstance(until, Until):
        return until.most, until
    return checked_integer("budget", budget, least, MOST_SIMULATIONS), None


def enough(engine: Bolfi, until: Until | None) -> Callable[[], bool]:
    """A function that looks, after the start design at every fifth simulation, whether to stop."""
    looked = engine.initial

    def stop() -> bool:
        nonlocal looked
        early = engine.told < looked + EVERY or engine.succeeded < MIN_LEARN
        if until is None or early:
            return False
        looked = engine.told
        return until._reached(engine.fit(warn=False))

    return stop
