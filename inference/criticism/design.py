"""The next experiment: of those that could be made, the one after which fewest names are wrong."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from .experiment import Proposal
from .held_out import judged
from .hypothesis import weighted_posterior
from .study import Study
from .verdict import Candidate, label

FINALISTS = 2  # proposals of which every draw is simulated
RIVAL_DRAWS = 3  # of each rival: the most probable parameters, and draws of its posterior
OUTCOMES = 4000  # of each rival, of which the expected error is the mean


class Rival(NamedTuple):
    """One of the explanations that an experiment should distinguish.

    Attributes:
        theta: Draws of its parameters, the most probable first, name -> [n].
        probability: Before the experiment; those of all rivals sum to 1.
    """

    theta: Mapping[str, np.ndarray]
    probability: float


class Suggestion(NamedTuple):
    """A proposed experiment, and the expected rate of wrong names after it.

    Attributes:
        label: Label of the proposal.
        between: The two rivals that it separates least well.
        snr: Signal-to-noise ratio of the difference between these two.
        error: Expected probability, in [0, 1], that the most probable rival is wrong after the
            experiment.
        before: The same probability without the experiment.
        cost: Cost of the proposal, in the proposal's unit.
    """

    label: str
    between: tuple[str, str]
    snr: float
    error: float
    before: float
    cost: float


def rivals_of(
    candidates: Sequence[Candidate], probability: Mapping[str, float], seed: int
) -> dict[str, Rival]:
    """Turn explanations into rivals by label.

    Their probabilities are scaled to the sum 1, and are equal where all of them are 0.
    """
    weights = np.array([probability[label(one.names)] for one in candidates])
    if not weights.sum() > 0.0:
        weights = np.ones(len(candidates))
    rivals = {}
    for one, share in zip(candidates, weights / weights.sum(), strict=True):
        best = one.hypothesis.best
        drawn = weighted_posterior(one.hypothesis, seed).draw(seed, RIVAL_DRAWS - 1)
        theta = {name: np.append(value, drawn[name]) for name, value in best.items()}
        rivals[label(one.names)] = Rival(theta, float(share))
    return rivals


def suggest(
    study: Study, proposals: Sequence[Proposal], rivals: Mapping[str, Rival]
) -> tuple[list[Suggestion], dict[str, str]]:
    """The best proposals, best first, and why others could not be simulated.

    Each is simulated once with every rival, the best `FINALISTS` with all draws (sequential
    halving, Karnin et al. 2013, of two rounds). One that cannot be simulated for each of the rivals
    is left out: label -> why. A run of each rival has the same seed, so what they differ by is not
    chance.
    """
    if len(rivals) < 2:
        return [], {}
    first = [(one, *_simulated(study, one, rivals, slice(0, 1))) for one in proposals]
    found = [(one, runs, assess(one, rivals, runs)) for one, runs, _ in first if runs.size]
    not_made = {one.label: error for one, runs, error in first if not runs.size}
    finalists = []
    for one, runs, _ in sorted(found, key=lambda of: rank(of[2]))[:FINALISTS]:
        more, _ = _simulated(study, one, rivals, slice(1, None))
        finalists.append(assess(one, rivals, np.concatenate([runs, more], axis=1)))
    return sorted(finalists, key=rank), not_made


def rank(suggestion: Suggestion) -> tuple[float, float]:
    """A key that sorts suggestions, best first."""
    return suggestion.error, -suggestion.snr


def _simulated(
    study: Study, proposal: Proposal, rivals: Mapping[str, Rival], draws: slice
) -> tuple[np.ndarray, str]:
    """Runs [rivals, n, values] of those draws that can be simulated for each of the rivals, and the
    first error of others."""
    thetas = [{name: of[draws] for name, of in one.theta.items()} for one in rivals.values()]
    again = ", again" if draws.start else ""
    phase = f"next {proposal.label}{again}"  # proposals may share a simulator's identity
    made = study.run_each(phase, thetas, proposal)
    common = set.intersection(*(set(runs.seeds.tolist()) for runs in made))
    rows = [[seed in common for seed in runs.seeds.tolist()] for runs in made]
    values = int(np.prod(proposal.shape))
    signals = [runs.signals[row].reshape(-1, values) for runs, row in zip(made, rows, strict=True)]
    return np.stack(signals), next((runs.error for runs in made if runs.error), "")


@in_float64
def assess(proposal: Proposal, rivals: Mapping[str, Rival], runs: np.ndarray) -> Suggestion:
    """Estimate how well a proposal separates rivals.

    The rivals' outputs are Gaussian with one covariance: that of the noise, and that between the
    runs of a rival, which its free parameters can absorb.

    Args:
        runs: Outputs [rivals, n, values]; the k-th runs of all rivals have one seed.
    """
    own, factor, span = judged(proposal.noise, np.zeros(proposal.shape), list(runs))
    noise = np.trace(span.T @ np.linalg.solve(factor, np.linalg.solve(factor, own).T) @ span)
    count, names = runs.shape[1], list(rivals)
    squared = np.zeros((len(names), len(names)))
    for i, j in combinations(range(len(names)), 2):
        apart = runs[i] - runs[j]
        length = np.sum((span.T @ np.linalg.solve(factor, apart.mean(0))) ** 2)
        # what runs of one seed have in common is gone from their difference
        left = np.var(apart, axis=0, ddof=1).sum() / np.trace(own) if own.any() else 0.0
        squared[i, j] = squared[j, i] = max(length - left * noise / count, 0.0)
    i, j = min(combinations(range(len(names)), 2), key=lambda pair: squared[pair])
    probability = np.array([one.probability for one in rivals.values()])
    before = 1.0 - float(probability.max())
    return Suggestion(
        label=proposal.label,
        between=(names[i], names[j]),
        snr=float(np.sqrt(squared[i, j])),
        error=min(naming_error(squared, probability), before),
        before=before,
        cost=proposal.cost,
    )


def naming_error(squared: np.ndarray, probability: np.ndarray) -> float:
    """Expected rate of wrong names, if the most probable rival is named after an experiment.

    Args:
        squared: Squared distances between the rivals' expected outputs, in the noise's sd [k, k].
        probability: Of each rival before the experiment [k].
    """
    # coordinates of these distances (classical scaling, Torgerson 1952)
    centring = np.eye(len(squared)) - 1.0 / len(squared)
    size, axes = np.linalg.eigh(-0.5 * centring @ squared @ centring)
    means = axes * np.sqrt(np.maximum(size, 0.0))
    noise = np.random.default_rng(0).normal(size=(OUTCOMES, len(means)))
    prior = np.log(np.maximum(probability, 1e-300)) - 0.5 * np.sum(means**2, axis=1)
    error = 0.0
    for mean, share in zip(means, probability, strict=True):
        log_posterior = prior + (mean + noise) @ means.T
        weight = np.exp(log_posterior - log_posterior.max(1, keepdims=True))
        error += share * float(np.mean(1.0 - 1.0 / weight.sum(1)))
    return float(error)


def remaining_sd(snr: float, sds_apart: float) -> float:
    """Sd of a parameter after an experiment over that before, by Laplace's approximation.

    Args:
        snr: By which the experiment separates two of its values.
        sds_apart: Distance of these values in the sd before.
    """
    return float((1.0 + (snr / sds_apart) ** 2) ** -0.5)
