"""From simulations to a surrogate, whoever keeps them."""

from typing import Any

import numpy as np

from ._float64 import in_float64
from .history import History
from .prior import Prior
from .surrogates.base import Family, RunOutcomes, Surrogate, TrainingData
from .surrogates.discrepancy import is_outlier
from .surrogates.families import checked_surrogate


def training_mask(history: History) -> np.ndarray:
    """Which runs are learned from, bool [n]: no copies, nor what blew up."""
    return history.distinct & ~is_outlier(history.discrepancy)


def training_data(view: Any, history: History, prior: Prior) -> TrainingData:
    """What a family learns from.

    Args:
        view: What was observed, as `Family.view` returned it.
    """
    good = training_mask(history)
    known = view, history.u[good], history.features[good], history.discrepancy[good]
    # runs that blew up did not succeed
    succeeded = history.succeeded & ~is_outlier(history.discrepancy)
    return TrainingData(*known, RunOutcomes(history.u, succeeded), prior)


def key_words(seed: int, asked: int) -> np.ndarray:
    """A key of JAX as NumPy makes it: JAX would compile for half a second."""
    return np.random.SeedSequence([seed, asked]).generate_state(2)


def learned_from(family: Family, data: TrainingData, words: np.ndarray) -> Surrogate:
    """The surrogate on which a fit rests."""
    return checked_surrogate(in_float64(family.learn)(data, words), family)
