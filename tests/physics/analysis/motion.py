"""How a liquid or a stick moves: speeds, energies, periods."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class Oscillation(NamedTuple):
    """Of a free, damped oscillation.

    Attributes:
        period: Between passages of the middle in one direction, the mean [s].
        decay: Rate of the amplitude's exponential decay [1/s].
        amplitude: The first swing's, from the middle.
        middle: Where it oscillates about.
    """

    period: float
    decay: float
    amplitude: float
    middle: float


class FarSide(NamedTuple):
    """The first extreme on the other side of the middle; NaN where there is none.

    Attributes:
        time: Since the signal's start, half a period of a free swing [s].
        ratio: Of that extreme to the signal's start, both from the middle.
    """

    time: float
    ratio: float


def rms_speed(velocity: ArrayLike) -> np.ndarray:
    """Root mean square of the speed [m/s]; velocities [..., n, 3] give shape [...]."""
    return np.sqrt(np.mean(np.sum(np.square(np.asarray(velocity, float)), axis=-1), axis=-1))


def passages(time: ArrayLike, signal: ArrayLike, level: float = 0.0) -> np.ndarray:
    """Times [s] at which a signal [t] crosses `level` in either direction, interpolated."""
    time, above = np.asarray(time, float), np.asarray(signal, float) - level
    before = np.flatnonzero(np.signbit(above[:-1]) != np.signbit(above[1:]))
    share = above[before] / (above[before] - above[before + 1])
    return time[before] + share * (time[before + 1] - time[before])


def oscillation(time: ArrayLike, signal: ArrayLike, middle: float = 0.0) -> Oscillation:
    """Period from the passages of the middle, decay from the peaks between them.

    Args:
        time: [s], shape [t].
        signal: Shape [t].
        middle: Position at rest.

    Raises:
        ValueError: the signal passes the middle less than three times.
    """
    time, signal = np.asarray(time, float), np.asarray(signal, float)
    at = passages(time, signal, middle)
    if len(at) < 3:
        raise ValueError(f"the signal passes its middle {len(at)} times; a period needs 3 passages")
    # between passages the bounds rise, so each swing is one slice
    swings = np.split(np.arange(len(time)), np.searchsorted(time, at))[1:-1]
    peak = np.array([np.abs(signal[swing] - middle).max() for swing in swings if len(swing)])
    when = np.array([time[swing].mean() for swing in swings if len(swing)])
    positive = peak > 0
    decay = -np.polyfit(when[positive], np.log(peak[positive]), 1)[0] if len(peak) > 1 else np.nan
    # an even number of half swings, in which an off-centre middle cancels
    whole = 2 * ((len(at) - 1) // 2)
    period = 2.0 * (at[whole] - at[0]) / whole
    return Oscillation(float(period), float(decay), float(peak[0]), float(middle))


def far_side(time: ArrayLike, signal: ArrayLike, middle: float = 0.0) -> FarSide:
    """Where a signal [t] that starts at rest off its middle goes on the other side.

    For swings that are damped so strongly that they have no period to speak of.
    """
    time, off = np.asarray(time, float), np.asarray(signal, float) - middle
    crossed = np.flatnonzero(off * np.sign(off[0]) < 0.0)
    if not len(crossed):
        return FarSide(np.nan, np.nan)
    back = np.flatnonzero(off[crossed[0] :] * np.sign(off[0]) > 0.0)
    stop = crossed[0] + back[0] if len(back) else len(off)
    at = crossed[0] + int(np.abs(off[crossed[0] : stop]).argmax())
    return FarSide(float(time[at] - time[0]), float(abs(off[at] / off[0])))
