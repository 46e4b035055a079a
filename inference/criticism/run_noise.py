"""Covariance of the differences between runs of equal parameters."""

from collections.abc import Sequence

import numpy as np

from ..gp.process import leave_one_out
from ..surrogates.emulator import Emulator
from ..surrogates.measurement_noise import Layout
from .measurement_noise import stationary
from .model_errors import positive_autocovariance

ALIKE_DISTANCE = 0.2  # of prior quantiles, over which a simulator's noise changes as a power
PRIOR_RUNS = 0.1  # runs
TINY_SQUARE = 1e-6  # of the largest square
SMOOTHED_SAMPLES = 15  # samples over which the noise's size varies


def smooth_covariance(errors: np.ndarray, layout: Layout, series: bool) -> np.ndarray:
    """Covariance [m, m] of the simulator's own noise, of which there are draws [n, m].

    Runs are few and the values many, so what the runs show is shrunk (Ledoit and Wolf 2004):
    for a series towards noise of a size that changes slowly and of one autocorrelation, both
    seen by all runs, samples and channels together; else towards independent noise. The usual
    target, white noise, would take smooth noise for white: the slow part would be thought
    quieter than it is, and right models be refused for it.
    """
    if not errors.any():  # a deterministic simulator
        return np.zeros((errors.shape[1],) * 2)
    target = _target(errors, layout) if series else np.diag(np.mean(errors**2, 0))
    return _shrunk(errors, target)


def resized(errors: np.ndarray, u: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Errors [n, m] of runs at prior quantiles u [n, d], as large as they would be at a centre [d].

    Thin liquid is noisier than thick: a local linear regression of the log of the runs' mean
    squares (Fan and Gijbels 1996) says how noisy it is where, also at the ends of a prior.
    """
    square = np.mean(errors**2, axis=1)
    if not square.any():
        return errors
    logs = np.log(np.maximum(square, TINY_SQUARE * square.max()))
    usual = logs.mean()

    def smoothed(point: np.ndarray) -> float:
        x = np.column_stack([np.ones(len(u)), (u - point) / ALIKE_DISTANCE])
        weighted = x * np.exp(-0.5 * np.sum(x[:, 1:] ** 2, axis=1))[:, None]
        # as if a run or less spoke for no change
        known = np.diag([PRIOR_RUNS] + [1.0] * u.shape[1])
        return float(np.linalg.solve(weighted.T @ x + known, weighted.T @ (logs - usual))[0])

    there = np.array([smoothed(point) for point in u])
    return errors * np.exp(0.5 * (smoothed(centre) - there))[:, None]


def errors_of(groups: Sequence[np.ndarray]) -> np.ndarray:
    """Draws of the noise [n, m] from groups of runs [k, m] of equal parameters."""
    return np.concatenate(
        [(group - group.mean(0)) * np.sqrt(len(group) / max(len(group) - 1, 1)) for group in groups]
    )


def own_errors(emulator: Emulator) -> np.ndarray:
    """One draw of the noise from each run that was learned from [n, m].

    Of the scores, what is left when a run is left out, less what the emulator's own error adds
    to it; of the rest, what the components leave. The components absorb part of the
    noise of their own runs: what the emulator took from the scores for it (`absorbed_noise`) is
    noise and is given back, and then nothing is lost to the rest.
    """
    basis, n = emulator.basis, len(emulator.outputs)
    used = basis.used
    gp = emulator.gp.only(slice(used))
    mean, variance = leave_one_out(gp)
    noise = np.exp(2.0 * gp.hyper.log_noise)[:, None]
    left = gp.data.y - mean
    left[:, : emulator.learned_at] /= 1.0 - emulator.excess[:used, None]
    scores = left * np.sqrt(np.minimum(noise / variance, 1.0))
    centred = np.sqrt(n / max(n - 1, 1))
    standard = scores.T @ basis.vectors[:, :used].T + centred * basis.residuals(emulator.outputs)
    return standard * basis.scale


def _target(errors: np.ndarray, layout: Layout) -> np.ndarray:
    """D^1/2 R D^1/2: a slowly varying size, and one autocorrelation."""
    size = np.empty(errors.shape[1])
    channels = [np.flatnonzero(layout.channel == c) for c in np.unique(layout.channel)]
    least = 1e-6 * np.mean(errors**2)
    for here in channels:
        window = np.ones(min(SMOOTHED_SAMPLES, len(here)))
        weight = np.convolve(np.ones(len(here)), window, "same")
        variance = np.convolve(np.mean(errors[:, here] ** 2, 0), window, "same") / weight
        size[here] = np.sqrt(np.maximum(variance, least))
    scaled = errors / size
    lags = int(layout.sample.max() - layout.sample.min()) + 1
    found = np.zeros(lags)
    for here in channels:
        rows = np.zeros((len(errors), lags))
        rows[:, layout.sample[here] - layout.sample.min()] = scaled[:, here]
        power = np.abs(np.fft.rfft(rows, 2 * lags, axis=1)) ** 2
        found += np.fft.irfft(power.mean(0), 2 * lags)[:lags] / lags
    correlation = positive_autocovariance(found / len(channels))
    return stationary(correlation, layout, layout) * np.outer(size, size) / correlation[0]


def _shrunk(errors: np.ndarray, target: np.ndarray) -> np.ndarray:
    """A mixture of the sample covariance and the target, of least expected squared error."""
    n = len(errors)
    sample = errors.T @ errors / n
    lengths = np.sum(errors**2, 1)
    own = np.sum(sample**2)
    error = (np.mean(lengths**2) - own) / n
    distance = np.sum((sample - target) ** 2)
    intensity = float(np.clip(error / distance, 0.0, 1.0)) if distance > 0 else 1.0
    return (1.0 - intensity) * sample + intensity * target
