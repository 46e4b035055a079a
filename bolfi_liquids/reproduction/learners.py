"""The learners of a study: stirring with either surrogate, and pouring."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..calibration.stir_simulator import Stirring, stirring_of
from ..inputs.bundled import bundled_recording
from ..inputs.prior import default_prior
from ..inputs.recording import Recording
from ..inputs.strokes import until_stroke
from .calibrations import ByPouring, ByStirring, Learner
from .study_size import Scale

if TYPE_CHECKING:
    from ..models import Cups


def by_stirring_and_pouring(
    cups: "Cups", scale: Scale, bank: str | Path = ":memory:", timeout: float | None = None
) -> dict[str, Learner]:
    """Stirring with either surrogate, and pouring as the paper's reference does.

    Args:
        cups: Of training pour and task.
        scale: How much is simulated.
        bank: Where simulations are kept.
        timeout: Seconds that one simulation may take; None sets no limit.
    """
    prior, stirring = default_prior(), _star(bundled_recording("water"), scale)
    rate = np.sqrt(np.prod(cups.angular_velocity_range))
    training = float(rate), float(np.mean(cups.distance_range))
    return {
        "signal": ByStirring(stirring, prior, "signal", scale.budgets, bank, timeout),
        "discrepancy": ByStirring(stirring, prior, "discrepancy", scale.budgets, bank, timeout),
        "pour": ByPouring(cups, prior, *training, scale.budgets, bank, timeout),
    }


def after_strokes(
    scale: Scale, bank: str | Path = ":memory:", timeout: float | None = None
) -> dict[str, Learner]:
    """Stirring that ends after each number of strokes; see `by_stirring_and_pouring`."""
    prior, whole = default_prior(), bundled_recording("water")
    return {
        str(number): ByStirring(
            _star(until_stroke(whole, number), scale), prior, "signal", (scale.few,), bank, timeout
        )
        for number in scale.strokes
    }


def _star(recording: Recording, scale: Scale) -> Stirring:
    return stirring_of([recording], scale.drawn_particles)
