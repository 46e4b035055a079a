"""Models' predictions of held-out data."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from ..surrogates.output_vectors import MIN_LONG
from .experiment import Experiment
from .hypothesis import error_sizes
from .measurement_noise import Noise, gaussian, samples
from .misfit import ACCEPTANCE_LEVEL, REPLICATES, exceedance, judged_modes, orthonormal
from .run_noise import errors_of, smooth_covariance

NOISE_QUANTILE = 0.99  # quantile of the noise's RMS below which a gap may be noise
MAX_LEFT_SHARE = 0.5  # of a gap beyond noise that an explanation may leave, unless it may be noise
MIN_LPD_GAIN = 3.0  # log predictive density to be won on all held-out data together


class Gap(NamedTuple):
    """Before and after, on one held-out experiment.

    Attributes:
        label: The experiment's.
        before, after: RMS of observed less expected, the known model error counted as expected.
        noise: RMS that measurement and the simulator's own noise would leave of a right model.
        model_error: RMS of the simulator's usual error besides.
        floor: RMS that these exceed once in a hundred times.
        p_value: Of what is left after, by its RMS and by its slow part (Bonferroni), all noise
            and the model error considered.
        lpd_gain: Log predictive density after less before.
        evidence: The same difference under one covariance for all explanations, so that these can
            be compared with one another.
    """

    label: str
    before: float
    after: float
    noise: float
    model_error: float
    floor: float
    p_value: float
    lpd_gain: float
    evidence: float

    @property
    def unexplained(self) -> tuple[float, float]:
        """Before and after, less the noise and the model error (in quadrature)."""
        known = float(np.hypot(self.noise, self.model_error))
        return excess_rms(self.before, known), excess_rms(self.after, known)


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
    level = ACCEPTANCE_LEVEL / (1 + len(gaps))  # the fitted data are a test, too
    fits = all(one.p_value > level for one in gaps)
    return bool(fits and explained and gained)


@in_float64
def gap(experiment: Experiment, before: np.ndarray, after: np.ndarray, seed: int) -> Gap:
    """Compare two models' predictions, [k, n] each.

    Both are judged under one covariance, so that neither wins by being vague: noise, and what
    runs at posterior draws differ by, pooled.
    """
    observed = experiment.corrected[np.isfinite(experiment.observed)]
    at, groups = samples(experiment.observed), [before, after]
    simulated, factor, span = judged(
        experiment.noise, experiment.observed, groups, _of_means(groups)
    )
    rng = np.random.default_rng(seed)
    runs = gaussian(rng, simulated, REPLICATES)
    null = experiment.noise.draw(rng, at, REPLICATES) + runs
    noise = experiment.measurement.draw(rng, at, REPLICATES) + runs

    def measures(rows: np.ndarray) -> np.ndarray:
        slow = np.sum((span.T @ np.linalg.solve(factor, rows.T)) ** 2, axis=0)
        return np.stack([np.mean(rows**2, axis=1), slow])

    means = np.stack([before.mean(0), after.mean(0)])
    left = measures(observed - means[1:])[:, 0]
    sizes = np.sqrt(np.mean((observed - means) ** 2, axis=1))
    known = np.trace(experiment.measurement.covariance(at) + simulated) / len(observed)
    covariance = experiment.noise.covariance(at) + simulated
    density = error_sizes(experiment.noise, at).log_densities(observed - means, covariance)
    gain = float(density[1] - density[0])
    return Gap(
        label=experiment.label,
        before=float(sizes[0]),
        after=float(sizes[1]),
        noise=float(np.sqrt(known)),
        model_error=experiment.model_error_rms,
        floor=float(np.quantile(np.sqrt(np.mean(noise**2, axis=1)), NOISE_QUANTILE)),
        p_value=min(1.0, 2.0 * float(exceedance(measures(null), left).min())),
        lpd_gain=gain,
        evidence=gain,
    )


@in_float64
def predictive_gains(experiments: Sequence[Experiment], groups: Sequence[np.ndarray]) -> np.ndarray:
    """Log predictive densities of models less that of the first, runs [k, n] each.

    What their runs differ by is pooled, so that they can be compared with one another.

    Args:
        experiments: The same held-out one, with each model's noise.
        groups: Runs of each model.
    """
    at, seen = samples(experiments[0].observed), np.isfinite(experiments[0].observed)
    simulated = _simulated(experiments[0].observed, groups, _of_means(groups))
    density = [
        error_sizes(one.noise, at).log_densities(
            (one.corrected[seen] - made.mean(0))[None], one.noise.covariance(at) + simulated
        )[0]
        for one, made in zip(experiments, groups, strict=True)
    ]
    return np.array(density[1:]) - density[0]


def _of_means(groups: Sequence[np.ndarray]) -> float:
    """Factor of the simulator's own noise in a run less the mean of few, which is noisy, too."""
    return 1.0 + 1.0 / min(map(len, groups))


def judged(
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
    simulated = _simulated(observed, groups, factor)
    at, series = samples(observed), len(observed) >= MIN_LONG
    root = np.linalg.cholesky(noise.covariance(at) + simulated)
    return simulated, root, orthonormal(np.linalg.solve(root, judged_modes(at, series)))


def _simulated(observed: np.ndarray, groups: Sequence[np.ndarray], factor: float) -> np.ndarray:
    """Covariance [n, n] of what runs of a model differ by, pooled, times a factor."""
    series = len(observed) >= MIN_LONG
    return factor * smooth_covariance(errors_of(groups), samples(observed), series)
