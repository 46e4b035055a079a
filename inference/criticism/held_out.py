"""Models' predictions of other experiments: of held-out data, and of experiments not yet made."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from ..surrogates.output_vectors import MIN_LONG
from .experiment import Experiment, Proposal
from .hypothesis import log_densities, sized_covariances
from .measurement_noise import Noise, gaussian, samples
from .misfit import ACCEPTANCE_LEVEL, exceedance, judged_modes, orthonormal
from .run_noise import errors_of, smooth_covariance
from .study import Study

NOISE_QUANTILE = 0.99  # quantile of the noise's RMS below which a gap may be noise
MAX_LEFT_SHARE = 0.5  # of a gap beyond noise that an explanation may leave, unless it may be noise
MIN_LPD_GAIN = 3.0  # log predictive density to be won on all held-out data together
REPLICATES = 999
RUNS_EACH = 3  # of each explanation in each proposed experiment


class Gap(NamedTuple):
    """Before and after, on one held-out experiment.

    Attributes:
        label: The experiment's.
        before, after: RMS of observed less expected, the known model error counted as expected.
        noise: RMS that measurement and the simulator's own noise would leave of a right model.
        model_error: RMS of the simulator's usual error besides.
        floor: RMS that these exceed once in a hundred times.
        p_before, p_value: Of what is left before and after, by its RMS and by its slow part
            (Bonferroni), all noise and the model error considered.
        lpd_gain: Log predictive density after less before.
    """

    label: str
    before: float
    after: float
    noise: float
    model_error: float
    floor: float
    p_before: float
    p_value: float
    lpd_gain: float

    @property
    def unexplained(self) -> tuple[float, float]:
        """Before and after, less the noise and the model error (in quadrature)."""
        known = float(np.hypot(self.noise, self.model_error))
        return excess_rms(self.before, known), excess_rms(self.after, known)

    @property
    def fits(self) -> bool:
        """Whether noise and model error may be all that is left."""
        return self.p_value > ACCEPTANCE_LEVEL / 2.0  # the fitted data are a test, too


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


def excess_rms(rms: float, noise: float) -> float:
    """RMS in excess of noise, subtracted in quadrature."""
    return max(rms**2 - noise**2, 0.0) ** 0.5


def holds(gaps: Sequence[Gap]) -> bool:
    """Whether an explanation holds on held-out data.

    It leaves no more than noise and the model error on each of them, predicts better on all of
    them together, and explains most of the gap there.

    The model error is taken off the gap, and a wrong explanation cannot hide behind it: it must
    predict better, and what it leaves must look like the model error.
    """
    if not gaps:
        return True
    before, after = np.sqrt(np.mean(np.square([one.unexplained for one in gaps]), axis=0))
    explained = after <= MAX_LEFT_SHARE * before or all(one.after <= one.floor for one in gaps)
    gained = sum(one.lpd_gain for one in gaps) > MIN_LPD_GAIN
    return bool(all(one.fits for one in gaps) and explained and gained)


@in_float64
def gap(
    experiment: Experiment,
    before: np.ndarray,
    after: np.ndarray,
    seed: int,
    others: Sequence[np.ndarray] = (),
) -> Gap:
    """Compare two models' predictions, [k, n] each.

    Both are judged under one covariance, so that neither wins by being vague: noise, and what
    runs at posterior draws differ by, pooled. Densities, by which models are compared with one
    another, are pooled over the `others`, too.
    """
    observed = experiment.corrected[np.isfinite(experiment.observed)]
    fewer = 1.0 + 1.0 / min(len(before), len(after))  # the mean of few runs is noisy, too
    at = samples(experiment.observed)
    simulated, factor, span = _judged(experiment.noise, experiment.observed, [before, after], fewer)
    rng = np.random.default_rng(seed)
    runs = gaussian(rng, simulated, REPLICATES)
    null = experiment.noise.draw(rng, at, REPLICATES) + runs
    noise = experiment.measurement.draw(rng, at, REPLICATES) + runs

    def measures(rows: np.ndarray) -> np.ndarray:
        slow = np.sum((span.T @ np.linalg.solve(factor, rows.T)) ** 2, axis=0)
        return np.stack([np.mean(rows**2, axis=1), slow])

    usual = measures(null)
    means = np.stack([before.mean(0), after.mean(0)])
    left = measures(observed - means)
    p_values = [min(1.0, 2.0 * float(exceedance(usual, seen).min())) for seen in left.T]
    pooled = _judged(experiment.noise, experiment.observed, [before, after, *others], fewer)[0]
    covariances, log_weight = sized_covariances(experiment.noise, at)
    density = log_densities(observed - means, [pooled + one for one in covariances], log_weight)
    sizes = np.sqrt(np.mean((observed - means) ** 2, axis=1))
    known = np.trace(experiment.measurement.covariance(at) + simulated) / len(observed)
    return Gap(
        label=experiment.label,
        before=float(sizes[0]),
        after=float(sizes[1]),
        noise=float(np.sqrt(known)),
        model_error=experiment.model_error_rms,
        floor=float(np.quantile(np.sqrt(np.mean(noise**2, axis=1)), NOISE_QUANTILE)),
        p_before=p_values[0],
        p_value=p_values[1],
        lpd_gain=float(density[1] - density[0]),
    )


def suggest(
    study: Study, proposals: Sequence[Proposal], rivals: Mapping[str, Mapping[str, float]]
) -> list[Suggestion]:
    """Proposals by how well they separate the worst separated rivals, best first.

    One that cannot be simulated for each of the rivals is left out.

    Args:
        rivals: Explanation -> parameters of its model.
    """
    if len(rivals) < 2:
        return []
    found = []
    for proposal in proposals:
        signals = {}
        for name, best in rivals.items():
            theta = {key: np.full(RUNS_EACH, value) for key, value in best.items()}
            (runs,) = study.run_each(f"next {proposal.label} {name}", [theta], proposal)
            if not len(runs):
                break
            signals[name] = runs.signals.reshape(len(runs), -1)
        else:
            found.append(separation(proposal, signals))
    return sorted(found, key=lambda one: -one.snr)


@in_float64
def separation(proposal: Proposal, signals: Mapping[str, np.ndarray]) -> Suggestion:
    """The least length of the whitened difference of two explanations' means in its slow part, less
    what the noise of the runs adds to it.

    Args:
        signals: Explanation -> runs [k, n] of the proposed experiment.
    """
    runs, factor, span = _judged(proposal.noise, np.zeros(proposal.shape), list(signals.values()))
    white = np.linalg.solve(factor, np.linalg.solve(factor, runs).T)
    own = np.trace(span.T @ white @ span)
    snr = {}
    for a, b in combinations(signals, 2):
        difference = signals[a].mean(0) - signals[b].mean(0)
        length = np.sum((span.T @ np.linalg.solve(factor, difference)) ** 2)
        noise = own * (1.0 / len(signals[a]) + 1.0 / len(signals[b]))
        snr[a, b] = float(np.sqrt(max(length - noise, 0.0)))
    worst = min(snr, key=lambda pair: snr[pair])
    return Suggestion(proposal.label, worst, snr[worst])


def _judged(
    noise: Noise, observed: np.ndarray, groups: Sequence[np.ndarray], factor: float = 1.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Prepare to judge predictions of n observed values.

    Args:
        groups: Runs [k, n] of each model.
        factor: Of the simulator's own noise.

    Returns:
        Covariances [n, n] of that noise, a lower Cholesky factor [n, n] of it and the other noise,
        and the whitened directions in which models are judged, orthonormal [n, d].
    """
    at, series = samples(observed), len(observed) >= MIN_LONG
    simulated = factor * smooth_covariance(errors_of(groups), at, series)
    root = np.linalg.cholesky(noise.covariance(at) + simulated)
    return simulated, root, orthonormal(np.linalg.solve(root, judged_modes(at, series)))
