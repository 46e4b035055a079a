"""Warnings from leave-one-out errors and the noise of an emulator, and from what was given,
whatever was learned of it."""

import warnings
from collections.abc import Sequence

import numpy as np

from .._lazy import stats
from ..history import History
from ..simulations.failures import FailureKind
from .squared_difference import independent

FALSE_ALARMS = 1e-3  # of each leave-one-out check, were its errors independent and normal
FAR_ERROR = 3.0  # studentised errors beyond are rare
OVERCONFIDENT_SQUARE = 1.5  # mean square of the studentised errors that matters
OUTSIDE = (
    "what was observed lies far outside of what was simulated: compare units, scales and offsets, "
    "or widen the prior; the posterior says little"
)
MISFIT = (
    "the simulator misses what was observed by more than the given noise, wherever it was run: the "
    "noise is larger than given, the simulator lacks something, or what fits was not found; the "
    "posterior allows for a misfit of that size: look at the residual of the closest run, "
    "correct noise=, or simulate more"
)
SMOOTH = (
    "what the simulator misses of what was observed varies as slowly as a signal: it lacks "
    "something rather than that the data are noisy; look at the residual of the closest run"
)
FEW_NUMBERS = (
    "no noise was given, and so few numbers cannot tell its size from a misfit of the parameters': "
    "the posterior's width rests on a guess; give noise="
)
DOUBTED = (
    "the posterior is much wider than the data make it: in places the emulator does not know what "
    "a simulation would give, so that nothing there disagrees; simulate more, or narrow the prior"
)
UNCONFIRMED = (
    "runs at draws of the posterior moved it, so that it is not known yet: simulate more, or "
    "narrow the prior"
)
COLLAPSED = (
    "the posterior is too narrow for its moments to be computed without sampling: whether runs at "
    "its draws moved it is not known; narrow the prior, or compare fits of more simulations"
)
GENEROUS = (
    "the closest simulation misses what was observed by much less than the given noise, which is "
    "larger than that of the data: the posterior is too wide; correct noise="
)
UNCERTAIN = (
    "much of what may be the posterior lies where the log likelihood is hardly known, or far above "
    "all that were simulated: the posterior may be too narrow, or miss a part; simulate more"
)
NEGATIVE = (
    "some discrepancies are negative, and taken for minus a log likelihood: let the simulator "
    'return the log likelihood, with surrogate="log_likelihood"; else give threshold='
)
LOW_THRESHOLD = (
    "the threshold lies below all that a simulation can be expected to come to: where the "
    "posterior lies is chance; give a larger threshold, or none"
)
NOISY = (
    "what the parameters do not predict of the discrepancy, because the simulator is random or so "
    "few runs do not show how it varies, exceeds what the data tell apart: the posterior is wider "
    "than the data make it, and its centre is as uncertain; simulate more, average the noise out, "
    'or use surrogate="signal"'
)
GUESSED = (
    "how far a discrepancy may exceed its least value is not known of so few numbers: the "
    "posterior's width rests on a guess; give threshold=, such as Matched(numbers) for a sum of "
    'that many squares, or use surrogate="signal" with noise=; a table of losses goes to '
    'fit_losses, minus a log likelihood, its sign changed, to surrogate="log_likelihood"'
)
SYSTEMATIC = (
    "the errors of the closest simulation hang together: the simulator lacks something, or what "
    "fits better was not found; the posterior allows for errors of that size; simulate more, or "
    'use surrogate="signal"'
)
UNEVEN = (
    "a few of the observed numbers make up nearly all of the discrepancy, even of the closest "
    "simulation: the others count for nothing; give a discrepancy of logarithms or of errors in "
    'units of their noise, or use surrogate="signal" with such a summary'
)
TOO_SMOOTH = (
    "the closest simulation is far smoother than what was observed, though others are as rough: a "
    "sum of squares prefers too little noise, and cannot tell its size; give a discrepancy of "
    'summaries that can, or use surrogate="signal" with them'
)
EQUAL = "all simulations are equal: the data cannot tell parameters apart"
UNPREDICTED = (
    "the parameters predict nothing of what was simulated, as far as so few runs can tell from "
    "chance: simulate more, or, if the simulator is random, choose a summary that averages the "
    "noise out; until then the posterior is the prior"
)
UNREPEATED = (
    "the parameters predict less than half of what simulations differ by: either the simulator is "
    "random, or the output changes faster than so few runs show; simulate more, or repeat some "
    "runs with other seeds"
)
TOO_FAST = (
    "runs of equal parameters agree, but the parameters predict less than half of what others "
    "differ by: the output changes faster, or in a narrower range, than so few runs show; simulate "
    "more, or narrow the prior"
)
WIDE_RANGE = (
    "what was observed spans more than three decades and no noise was given: one size of noise is "
    "taken for all values, so that only the largest count; give noise=, such as "
    'inference.relative(0.2) or "poisson", or summary=np.log'
)
WIDE_RATIO = 1e3  # of observed values, from which one size of noise is hardly meant
FAILED_SHARE = 0.5  # of the simulations, beyond which a fit warns
EQUAL_SHARE, LEAST_EQUAL = 0.25, 5  # of a channel's samples, from which they may be cut off
ROUNDED_SHARE = 1e-6  # of their range, to which data may be rounded without losing anything
NEAR_RUNS = 5  # whose spread tells how closely runs approach what was observed
NOISE_SDS = 3.0  # up to which noise explains that no run reaches what was observed
OUTSIDE_VARIANCES = 4.0  # of the runs, beyond which the closest run's misfit is far off
UNEVEN_SHARE = 0.1  # of the root mean square error, below which the median error is too small
ROUGHER = 0.9  # share of the runs, of which the others are as rough as the data
SYSTEMATIC_SHARE = 0.15  # of the numbers, to which a residual amounts that is no noise
MIN_ROUGH = 8  # numbers of which unevenness, and samples of which roughness, is judged
NOISY_SHARES = (0.9, 0.5)  # shares of run-to-run noise in the variance that deserve a word


class EmulatorWarning(UserWarning):
    """A fit may be wrong, too wide or too narrow; the message says why, and what to do."""


def complain(said: Sequence[str], stacklevel: int) -> None:
    """Raise each complaint as a warning; stacklevel 2 blames the caller."""
    for complaint in said:
        warnings.warn(complaint, EmulatorWarning, stacklevel=stacklevel)


def complaints(loo_z: np.ndarray, what: str) -> list[str]:
    """Warnings, or an empty list; usual texts are constant: Python's filter shows each once.

    Args:
        loo_z: Studentised leave-one-out errors [n, k].
        what: Name of the emulated quantity.
    """
    count = loo_z.size
    said: list[str] = []
    if not count:
        return said
    far = int(np.sum(np.abs(loo_z) > FAR_ERROR))
    if far > stats.binom.isf(FALSE_ALARMS, count, 2.0 * stats.norm.sf(FAR_ERROR)):
        said.append(
            f"{far} of {count} leave-one-out errors of the {what} exceed {FAR_ERROR:g} standard "
            "deviations: it is not Gaussian, or changes faster than the emulator predicts; "
            "simulate more, or choose a summary or transform that behaves better"
        )
    square = np.mean(loo_z**2)
    if square > max(OVERCONFIDENT_SQUARE, stats.chi2.isf(FALSE_ALARMS, count) / count):
        said.append(
            f"leave-one-out errors of the {what} are {np.sqrt(square):.1f} times what the emulator "
            "predicts; simulate more"
        )
    return said


def noise_warnings(share: float, repeats: np.ndarray, sized: bool) -> list[str]:
    """A warning if what no parameter predicts is a large share of the outputs' variance.

    Args:
        share: That share.
        repeats: Of each repeated run: whether it differs from the one before, bool [r].
        sized: Whether the noise's size is known to depend on the parameters.
    """
    reached = [least for least in NOISY_SHARES if share > least]
    if not reached or sized:
        return []
    if not repeats.any():
        return [TOO_FAST if len(repeats) else UNREPEATED]
    return [
        f"run-to-run noise makes up more than {reached[0]:.0%} of the output's variance "
        "between simulations, and the likelihood takes it as Gaussian and equal for all "
        "parameters; where it is not, as with noise that accumulates, the posterior is off: "
        "compare the other surrogate, or choose a summary that averages the noise out"
    ]


def history_warnings(history: History) -> list[str]:
    """Warnings if most simulations failed, or if equal seeds gave unlike signals."""
    told, succeeded = len(history.theta), int(history.succeeded.sum())
    failed = told - succeeded - history.failures.get(FailureKind.IMPOSSIBLE.value, 0)
    contradicting = history.contradicting
    said = []
    if failed > FAILED_SHARE * told:
        said.append(
            f"{failed} of {told} simulations failed: the fit rests on {succeeded}"
            f"{history.last_error}"
        )
    if contradicting:
        said.append(
            f"{contradicting} of {told} simulations have theta and seed of an earlier one, but "
            "another signal: all are learned from; give each run a seed of its own, or make "
            "signals follow from theta and seed"
        )
    return said


def shape_warnings(history: History) -> list[str]:
    """A warning if a summary is taken of data that have a summary's shape, not a simulation's."""
    seen, simulated = history.observed_shape, history.signal_shape
    said = (
        f"observed has the shape {seen} of a summary, simulations {simulated}: observed is to be "
        "the raw output, of which the summary is taken as of each simulation's"
    )
    return [said] if seen == history.features.shape[1:] != simulated else []


def unconfirmed_warnings(history: History, runs: np.ndarray) -> list[str]:
    """Why runs at draws of the posterior do not confirm it.

    Args:
        history: Of all runs.
        runs: Rows of these.
    """
    errors = [error for error in history.errors[runs] if error]
    if 2 * len(errors) <= len(runs):
        return [UNCONFIRMED]
    return [
        f"{len(errors)} of {len(runs)} runs at draws of the posterior failed; the last error: "
        f"{errors[-1]}: mend the cause, or simulate more, so that it is known where runs fail"
    ]


def censored_warnings(observed: np.ndarray, simulated: np.ndarray) -> list[str]:
    """A warning for each channel that was observed as cut off at a limit.

    A quarter of its samples equal their least or their largest value, and most of what was
    simulated there differs from that by more than the data are rounded.

    Args:
        observed: [*signal_shape], NaN where missing.
        simulated: The closest simulation, of the same shape.
    """
    samples = len(np.atleast_1d(observed))
    channels = observed.reshape(samples, -1).T, simulated.reshape(samples, -1).T
    said = []
    for seen, made in zip(*channels, strict=True):
        present = seen[np.isfinite(seen)]
        values, counts = np.unique(present, return_counts=True)
        for end in {0, len(values) - 1} if len(values) > 1 else ():
            enough = counts[end] >= max(LEAST_EQUAL, EQUAL_SHARE * len(present))
            unlike = np.abs(made[seen == values[end]] - values[end]) > _step(values)
            if enough and unlike.mean() > 0.5:
                said.append(
                    f"{counts[end]} of {len(present)} observed values are {values[end]:g}, and "
                    "the closest simulation differs there: if they are cut off at a limit, let "
                    "the simulator, or a summary, cut off its output in the same way; if they "
                    "are lost, give NaN"
                )
    return said


def range_warnings(observed: np.ndarray) -> list[str]:
    """A warning if positive data of unknown noise span decades."""
    seen = observed[np.isfinite(observed)]
    wide = seen.min() > 0.0 and seen.max() > WIDE_RATIO * seen.min()
    return [WIDE_RANGE] if wide else []


def _step(values: np.ndarray) -> float:
    """The step of which all differences between sorted values are multiples, by Euclid's
    algorithm: that to which they were rounded, or next to nothing."""
    step, least = 0.0, ROUNDED_SHARE * np.ptp(values)
    for difference in np.diff(values):
        while difference > least:
            step, difference = difference, step % difference
    return float(step)


def unreached_warnings(observed: np.ndarray, simulated: np.ndarray, noise: float) -> list[str]:
    """A warning if one number was observed below, or above, all that were simulated.

    The runs nearest to it lie closer together than to it, and noise does not reach as far: a loss,
    whose least value is above zero, looks like that.

    Args:
        observed: [1]
        simulated: [n, 1]
        noise: Sd of what the simulator does not make.
    """
    if observed.size != 1:
        return []
    further = np.sort(simulated[:, 0] - observed[0])  # than what was observed
    side, distance = ("below", further) if further[0] > 0.0 else ("above", -further[::-1])
    near = distance[:NEAR_RUNS]
    if near[0] <= max(0.0, np.ptp(near), NOISE_SDS * noise):
        return []
    return [
        f"the observed number, {observed[0]:.4g}, lies {side} all {len(distance)} simulated ones, "
        f"{near[0]:.4g} from the nearest: give losses to fit_losses, or say so by discrepancy=; "
        'log likelihoods need surrogate="log_likelihood"; else widen the prior, or give noise='
    ]


def distance_warnings(observed: np.ndarray, outputs: np.ndarray) -> list[str]:
    """Warnings against a sum of squared differences.

    Args:
        observed: [t, ...], NaN where missing.
        outputs: Of the simulations, the closest first [n, t, ...].
    """
    n, t = outputs.shape[:2]
    unit = max(np.nanmax(np.abs(observed)), np.nanmax(np.abs(outputs))) or 1.0
    observed, outputs = observed / unit, outputs / unit
    there = np.isfinite(observed.reshape(t, -1))
    error = np.where(there, (outputs[0] - observed).reshape(t, -1), 0.0)
    runs = np.where(there, outputs.reshape(n, t, -1), 0.0)
    said = []
    if (np.sum(error**2, 0) > OUTSIDE_VARIANCES * np.sum(runs.var(0), 0)).any():
        said.append(f'{OUTSIDE}; surrogate="signal" may say which part')
    residual = np.where(there, error, np.nan)
    if t >= MIN_ROUGH and independent(residual) < SYSTEMATIC_SHARE * there.sum():
        said.append(SYSTEMATIC)
    size = np.abs(error[there])
    small = UNEVEN_SHARE * np.sqrt(np.mean(size**2))
    ignored = np.linalg.norm(error, axis=0) < small * np.sqrt(there.sum(0))  # channels
    if size.size >= MIN_ROUGH and (np.median(size) < small or ignored.any()):
        said.append(UNEVEN)
    if t < MIN_ROUGH or not there.all():
        return said
    rough = np.mean(np.diff(runs, 4, axis=1) ** 2, axis=(1, 2))
    data = np.mean(np.diff(observed.reshape(t, -1), 4, axis=0) ** 2)
    return [*said, TOO_SMOOTH] if rough[0] < data / 4.0 < np.quantile(rough, ROUGHER) else said
