"""Discrepancies between an observed and a simulated signal."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import checked_array
from ..simulations.failures import Failure, incomparable, raised
from ..types import Discrepancy
from .output_vectors import MIN_SERIES, check_shape

MIN_FREEDOM = 3  # numbers more than parameters, from which the size of the noise can be told


def squared_difference(time: ArrayLike | None = None) -> Discrepancy:
    """Integrated squared difference, summed over channels.

    Delta = int (y(t) - y~(t))^2 dt (Lopez-Guevara et al. 2018, problem definition), by the
    trapezoidal rule over the samples that were observed: NaN in `observed` is a missing
    sample, and the rule spans the gap between its neighbours.

    Args:
        time: Sample times [s], strictly increasing, shape [t]; steps of 1 if omitted.

    Returns:
        Callable (observed, simulated) -> float; both of shape [t, ...], time first.

    Raises:
        ValueError: `time` is not strictly increasing; on call, shapes differ or no channel
            has two observed samples.
    """
    grid = None if time is None else checked_array("time", time)
    if grid is not None and (grid.ndim != 1 or not (np.diff(grid) > 0).all()):
        raise ValueError(f"time must be strictly increasing with shape [t], got {grid.shape}")

    return partial(_integrated, grid)  # a closure could not be pickled


def _integrated(grid: np.ndarray | None, observed: np.ndarray, simulated: np.ndarray) -> float:
    observed = np.asarray(observed, np.float64)
    simulated = np.asarray(simulated, np.float64)
    check_shape("a signal", observed.shape, simulated.shape)
    weights = _trapezoid_weights(np.isfinite(observed), grid)
    used = weights > 0
    with np.errstate(all="ignore"):  # of a run that blew up
        return float(np.sum(weights[used] * (observed[used] - simulated[used]) ** 2))


def sum_of_squares(observed: np.ndarray, simulated: np.ndarray) -> float:
    """Sum of squared differences, missing samples left out.

    Raises:
        ValueError: shapes differ.
    """
    check_shape("an output", observed.shape, simulated.shape)
    there = np.isfinite(observed)
    with np.errstate(all="ignore"):  # of a run that blew up
        return float(np.sum((observed[there] - simulated[there]) ** 2))


def _trapezoid_weights(present: np.ndarray, time: np.ndarray | None) -> np.ndarray:
    """Weights of the trapezoidal rule over the samples that are present, channel by channel.

    Args:
        present: bool [t, ...].
        time: [t], or steps of 1 if None.

    Returns:
        [t, ...]; zero where absent.
    """
    steps = present.shape[0] if present.ndim else 0
    grid = np.arange(steps, dtype=np.float64) if time is None else time
    if grid.shape != (steps,):
        raise ValueError(f"time has shape {grid.shape}, but observed has {steps} samples")
    columns = present.reshape(steps, -1) if steps else np.zeros((0, 0), bool)
    weights = np.zeros(columns.shape)
    for column, where in zip(weights.T, columns.T, strict=True):
        half = np.diff(grid[where]) / 2
        column[where] = (np.pad(half, (0, 1)) + np.pad(half, (1, 0)))[: where.sum()]
    if not weights.any():
        raise ValueError(
            "observed must have two finite samples in some channel; for data that are not a "
            "time series give discrepancy="
        )
    return weights.reshape(present.shape)


def evaluate(
    compare: Discrepancy,
    observed: np.ndarray,
    signals: Sequence[np.ndarray | None],
    named: str = "discrepancy",
) -> tuple[np.ndarray, list[Failure | None]]:
    """Discrepancy of each signal, and why there is none.

    Args:
        compare: The discrepancy; it may write into what it is given.
        observed: What was measured.
        signals: Of any shapes; None, or NaN throughout, is the mark of a failed run, on which a
            user's function may stumble.
        named: What `compare` is to the user.

    Returns:
        float64 [n], NaN where a run failed or has no finite discrepancy; and for each signal why
        it cannot be compared, None elsewhere.
    """
    values = np.full(len(signals), np.nan)
    errors: list[Failure | None] = [None] * len(signals)
    for i, signal in enumerate(signals):
        if signal is None or (signal.size and np.isnan(signal).all()):
            continue
        try:
            values[i] = _number(named, compare(observed.copy(), signal.copy()))
        except (Exception, SystemExit) as error:  # whatever the user's code raises costs this run
            errors[i] = failed_on(named, signal, observed, error)
    return values, errors


def failed_on(
    named: str, signal: np.ndarray, observed: np.ndarray, error: BaseException
) -> Failure:
    """The failure of a run on whose signal the user's function raised."""
    return incomparable(
        f"the {named} failed on a signal of shape {signal.shape}, observed being of shape "
        f"{observed.shape} ({raised(error)})"
    )


def _number(named: str, returned: object) -> float:
    if returned is None:
        return np.nan
    value = checked_array(f"what {named} returns", returned)
    if value.shape != ():
        raise ValueError(f"{named} must return one number, got shape {value.shape}")
    return float(value) if np.isfinite(value) else np.nan


def numbers(residual: np.ndarray) -> float:
    """Number of observed values."""
    return float(np.isfinite(residual).sum())


def independent(residual: np.ndarray) -> float:
    """The number of independent normal errors of equal size that a residual amounts to.

    Fewer than there are where neighbours in time are correlated, (1 - rho) / (1 + rho) of them,
    and where a few are much larger than the others: sum(e^2)^2 / sum(e^4) is a third of it.

    Args:
        residual: [t, ...], time first; NaN where nothing was observed.
    """
    error = np.nan_to_num(residual).reshape(len(residual), -1) if residual.ndim else residual[None]
    size, count = np.abs(error).max(), numbers(residual)
    if not size > 0.0:
        return count
    with np.errstate(under="ignore"):
        error = error / size
        squares = np.sum(error**2)
    rho = np.sum(error[1:] * error[:-1]) / squares if len(error) >= MIN_SERIES else 0.0
    uneven = 3.0 * squares**2 / np.sum(error**4) / count
    return float(count * min(1.0, (1.0 - rho) / (1.0 + rho)) * min(1.0, uneven))
