"""The learners of a study: stirring with either surrogate, and pouring."""

from pathlib import Path

import numpy as np
from bolfi_liquids.models import Cups

from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.inputs.recording import Recording
from bolfi_liquids.inputs.strokes import strokes
from bolfi_liquids.simulators import StirSimulator, stir_simulator

from .calibrations import ByPouring, ByStirring, Learner
from .study_size import Scale


def by_stirring_and_pouring(cups: Cups, scale: Scale, bank: str | Path) -> dict[str, Learner]:
    """StirSimulator with either surrogate, and pouring as the paper's reference does.

    Args:
        cups: Of training pour and task.
        scale: How much is simulated.
        bank: Where simulations are kept.
    """
    prior, stirring = default_prior(), _star(bundled_recording("water"), scale)
    rate = np.sqrt(np.prod(cups.angular_velocity_range))
    training = float(rate), float(np.mean(cups.distance_range))
    return {
        "signal": ByStirring(stirring, prior, "signal", scale.budgets, bank),
        "discrepancy": ByStirring(stirring, prior, "discrepancy", scale.budgets, bank),
        "pour": ByPouring(cups, prior, *training, scale.budgets, bank),
    }


def after_strokes(scale: Scale, bank: str | Path) -> dict[str, Learner]:
    """StirSimulator that ends after each number of strokes; see `by_stirring_and_pouring`."""
    prior, whole = default_prior(), bundled_recording("water")
    return {
        str(number): ByStirring(
            _star(until_stroke(whole, number), scale), prior, "signal", (scale.few,), bank
        )
        for number in scale.strokes
    }


def until_stroke(recording: Recording, number: int) -> Recording:
    """The recording as it would be if stirring had ended after a stroke, counted from 1.

    Raises:
        ValueError: There are fewer strokes.
    """
    found = {stroke.number: stroke.samples for stroke in strokes(recording)}
    if number not in found:
        raise ValueError(f"stroke must be one of {', '.join(map(str, found))}, got {number}")
    return recording.first(int(np.flatnonzero(found[number])[-1]) + 1)


def _star(recording: Recording, scale: Scale) -> StirSimulator:
    return stir_simulator([recording], scale.drawn_particles)
