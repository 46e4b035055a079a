"""Which further experiment would tell explanations apart."""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from ..surrogates.output_vectors import MIN_LONG
from .experiment import Proposal
from .measurement_noise import samples
from .misfit import MODES_PER_CHANNEL, orthonormal, slow_modes
from .run_noise import errors_of, smooth_covariance
from .study import Study
from .verdict import Candidate

RUNS_EACH = 3  # of each explanation in each proposed experiment


class Suggestion(NamedTuple):
    """Expected separation of two explanations by an experiment.

    Attributes:
        label: The experiment's.
        between: The two that it separates least well, each its effects' names.
        snr: Signal-to-noise ratio of their difference.
    """

    label: str
    between: tuple[str, str]
    snr: float


def suggest(
    study: Study, proposals: Sequence[Proposal], rivals: Sequence[Candidate]
) -> list[Suggestion]:
    """Proposals by how well they separate the worst separated rivals, best first.

    One that cannot be simulated for each of the rivals is left out.
    """
    if len(rivals) < 2:
        return []
    made = (_separation(study, proposal, rivals) for proposal in proposals)
    return sorted(filter(None, made), key=lambda suggestion: -suggestion.snr)


def _separation(study: Study, proposal: Proposal, rivals: Sequence[Candidate]) -> Suggestion | None:
    names = [" with ".join(rival.names) for rival in rivals]
    signals = []
    for name, rival in zip(names, rivals, strict=True):
        theta = {key: np.full(RUNS_EACH, value) for key, value in rival.hypothesis.best.items()}
        (runs,) = study.run_each(f"next {proposal.label} {name}", [theta], proposal)
        if not len(runs):
            return None
        signals.append(runs.signals.reshape(len(runs), -1))
    snr = {
        (names[a], names[b]): _distance(proposal, signals, a, b)
        for a, b in combinations(range(len(rivals)), 2)
    }
    worst = min(snr, key=lambda pair: snr[pair])
    return Suggestion(proposal.label, worst, snr[worst])


@in_float64
def _distance(proposal: Proposal, signals: Sequence[np.ndarray], a: int, b: int) -> float:
    """Length of the whitened difference of two means in its slow part, less what the noise of
    the runs adds to it."""
    at = samples(np.zeros(proposal.shape))
    series = proposal.shape[0] >= MIN_LONG
    runs = smooth_covariance(errors_of(signals), at, series)
    covariance = proposal.noise.covariance(at) + runs
    factor = np.linalg.cholesky(covariance)
    modes = slow_modes(at, MODES_PER_CHANNEL) if series else np.eye(len(at.sample))
    span = orthonormal(np.linalg.solve(factor, modes))
    difference = signals[a].mean(0) - signals[b].mean(0)
    length = np.sum((span.T @ np.linalg.solve(factor, difference)) ** 2)
    white = np.linalg.solve(factor, np.linalg.solve(factor, runs).T)
    own = np.trace(span.T @ white @ span) * (1.0 / len(signals[a]) + 1.0 / len(signals[b]))
    return float(np.sqrt(max(length - own, 0.0)))
