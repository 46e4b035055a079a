"""Warnings from what was given, whatever the surrogate learned of it."""

import numpy as np

from .history import History

FAILED_SHARE = 0.5  # of the simulations, beyond which a fit warns
EQUAL_SHARE, LEAST_EQUAL = 0.25, 5  # of a channel's samples, from which they may be cut off
ROUNDED_SHARE = 1e-6  # of their range, to which data may be rounded without losing anything
NEAR_RUNS = 5  # whose spread tells how closely runs approach what was observed
NOISE_SDS = 3.0  # up to which noise explains that no run reaches what was observed


def history_warnings(history: History) -> list[str]:
    """That most simulations failed, and that equal seeds gave unlike signals."""
    told, succeeded = len(history.theta), int(history.succeeded.sum())
    failed, contradicting = told - succeeded, history.contradicting
    said = []
    if failed > FAILED_SHARE * told:
        last = [error for error in history.errors if error][-1]
        said.append(
            f"{failed} of {told} simulations failed: the fit rests on {succeeded}; the last "
            f"error: {last}"
        )
    if contradicting:
        said.append(
            f"{contradicting} of {told} simulations have theta and seed of an earlier one, but "
            "another signal: all are learned from; give each run a seed of its own, or make "
            "signals follow from theta and seed"
        )
    return said


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
        f"{near[0]:.4g} from the nearest: if they are losses, say so by discrepancy=, such as "
        "lambda observed, simulated: float(simulated[0]); else widen the prior, or give noise="
    ]
