"""Faults of a simulation: it stops, its result is NaN, and a warning says why."""

import warnings

import numpy as np

LARGEST = 1e30  # squared speed [m²/s²] that single precision can still work with
SOUND, RUNAWAY, UNSOLVED, DRIFTED = range(4)
ABSENT = -1  # of a place among simulations that march together
REASONS = {
    UNSOLVED: "its viscosity is too large to compute with; take a smaller one",
    DRIFTED: "its level moved by more than 2 %: give more particles, or check cup, fill and stick",
    RUNAWAY: "a particle ran away: its velocity is not finite or beyond any liquid's",
}


class FailedSimulation(UserWarning):
    """A simulation stopped; its result is NaN."""


def faulty(faults: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """Which simulations went wrong, bool [B], after a warning for each.

    Args:
        faults: Code of each simulation's fault, [B].
        seeds: Their seeds [B], for the message.
    """
    for fault, seed in zip(faults, seeds, strict=True):
        if fault != SOUND:
            warnings.warn(
                f"simulation with seed {seed}: {REASONS[int(fault)]}; its result is NaN",
                FailedSimulation,
                stacklevel=2,
            )
    return faults != SOUND
