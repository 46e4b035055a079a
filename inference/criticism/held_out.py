"""Whether an explanation holds on data that it was not fitted to."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from ..surrogates.output_vectors import MIN_LONG
from .experiment import Experiment
from .measurement_noise import gaussian, samples
from .misfit import ACCEPTANCE_LEVEL, MODES_PER_CHANNEL, exceedance, orthonormal, slow_modes
from .run_noise import errors_of, smooth_covariance
from .usual_residual import model_error_rms, without_model_error

NOISE_QUANTILE = 0.99  # quantile of the noise's RMS below which a gap may be noise
MAX_LEFT_SHARE = 0.5  # of a gap beyond noise that an explanation may leave, unless it may be noise
MIN_LPD_GAIN = 3.0  # log predictive density to be won on all held-out data together
REPLICATES = 999


class Gap(NamedTuple):
    """Before and after, on one held-out experiment.

    Attributes:
        label: The experiment's.
        before, after: RMS of observed less expected, what is known to be usual included.
        noise: RMS that measurement and the simulator's own noise would leave of a right model.
        usual: RMS of what is usual for the simulator besides.
        floor: RMS that these exceed once in a hundred times.
        p_value: Of what is left after, by its RMS and by its slow part (Bonferroni), all noise
            and what is usual for the simulator considered.
        lpd_gain: Log predictive density after less before.
    """

    label: str
    before: float
    after: float
    noise: float
    usual: float
    floor: float
    p_value: float
    lpd_gain: float

    @property
    def unexplained(self) -> tuple[float, float]:
        """Before and after, less the noise and what is usual (in quadrature)."""
        known = float(np.hypot(self.noise, self.usual))
        return beyond(self.before, known), beyond(self.after, known)

    @property
    def fits(self) -> bool:
        """Whether noise, and what is usual, may be all that is left."""
        return self.p_value > ACCEPTANCE_LEVEL


def beyond(rms: float, noise: float) -> float:
    """RMS in excess of noise, subtracted in quadrature."""
    return max(rms**2 - noise**2, 0.0) ** 0.5


def holds(gaps: Sequence[Gap]) -> bool:
    """Whether an explanation holds on held-out data.

    It leaves no more than noise and the usual residual on each of them, predicts better on all of
    them together, and explains most of the gap there.

    What is usual is taken off the gap, and a wrong explanation cannot hide behind it: it must
    predict better, and what it leaves must look like what is usual.
    """
    if not gaps:
        return True
    before, after = np.sqrt(np.mean(np.square([one.unexplained for one in gaps]), axis=0))
    explained = after <= MAX_LEFT_SHARE * before or all(one.after <= one.floor for one in gaps)
    gained = sum(one.lpd_gain for one in gaps) > MIN_LPD_GAIN
    return bool(all(one.fits for one in gaps) and explained and gained)


@in_float64
def gap(experiment: Experiment, before: np.ndarray, after: np.ndarray, seed: int) -> Gap:
    """Compare two models' predictions, [k, n] each.

    Both are judged under one covariance, so that neither wins by being vague: noise, and what
    runs at posterior draws differ by, pooled.
    """
    observed = experiment.corrected[np.isfinite(experiment.observed)]
    fewer = 1.0 + 1.0 / min(len(before), len(after))  # the mean of few runs is noisy, too
    at = samples(experiment.observed)
    series = len(experiment.observed) >= MIN_LONG
    simulated = fewer * smooth_covariance(errors_of([before, after]), at, series)
    covariance = experiment.noise.covariance(at) + simulated
    measured = without_model_error(experiment.noise)
    factor = np.linalg.cholesky(covariance)
    rng = np.random.default_rng(seed)
    runs = gaussian(rng, simulated, REPLICATES)
    null = experiment.noise.draw(rng, at, REPLICATES) + runs
    noise = measured.draw(rng, at, REPLICATES) + runs
    modes = slow_modes(at, MODES_PER_CHANNEL) if series else np.eye(len(observed))
    span = orthonormal(np.linalg.solve(factor, modes))

    def measures(rows: np.ndarray) -> np.ndarray:
        slow = np.sum((span.T @ np.linalg.solve(factor, rows.T)) ** 2, axis=0)
        return np.stack([np.mean(rows**2, axis=1), slow])

    def density(mean: np.ndarray) -> float:
        return -0.5 * float(np.sum(np.linalg.solve(factor, observed - mean) ** 2))

    means = before.mean(0), after.mean(0)
    left = measures((observed - means[1])[None])[:, 0]
    sizes = [float(np.sqrt(np.mean((observed - mean) ** 2))) for mean in means]
    return Gap(
        label=experiment.label,
        before=sizes[0],
        after=sizes[1],
        noise=float(np.sqrt(np.trace(measured.covariance(at) + simulated) / len(observed))),
        usual=model_error_rms(experiment.noise, experiment.observed),
        floor=float(np.quantile(np.sqrt(np.mean(noise**2, axis=1)), NOISE_QUANTILE)),
        p_value=min(1.0, 2.0 * float(exceedance(measures(null), left).min())),
        lpd_gain=density(means[1]) - density(means[0]),
    )
