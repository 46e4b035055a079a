"""How a liquid or a stick moves: speeds, energies, periods."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares


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


def kinetic_energy(velocity: ArrayLike, particle_mass: float) -> np.ndarray:
    """Of all particles [J]; velocities [m/s], shape [..., n, 3]."""
    return 0.5 * particle_mass * np.sum(np.square(np.asarray(velocity, float)), axis=(-1, -2))


def mean_velocity(velocity: ArrayLike) -> np.ndarray:
    """Of the centre of mass [m/s]; velocities [..., n, 3] give shape [..., 3]."""
    return np.mean(np.asarray(velocity, float), axis=-2)


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


def fit_damped_oscillation(time: ArrayLike, signal: ArrayLike, period: float) -> Oscillation:
    """Least squares of m + a exp(-d t) cos(2π t/T + phase), for strong damping or an unknown m.

    Args:
        time: [s], shape [t].
        signal: Shape [t].
        period: A first guess, right within a third [s].

    Raises:
        ValueError: the fit did not converge.
    """
    time, signal = np.asarray(time, float), np.asarray(signal, float)
    shifted = time - time[0]
    span = float(np.ptp(signal)) or 1.0

    def residual(parameters: np.ndarray) -> np.ndarray:
        turns, decay, cosine, sine, middle = parameters
        phase = 2.0 * np.pi * turns * shifted / period
        wave = cosine * np.cos(phase) + sine * np.sin(phase)
        return middle + np.exp(-decay * shifted) * wave - signal / span

    start = np.array([1.0, 0.3 / period, 0.5, 0.0, signal.mean() / span])
    fit = least_squares(residual, start, x_scale=(0.1, 1 / period, 0.1, 0.1, 0.1))
    if not fit.success:
        raise ValueError(f"no damped oscillation fits: {fit.message}")
    turns, decay, cosine, sine, middle = (float(value) for value in fit.x)
    amplitude = span * np.hypot(cosine, sine)
    return Oscillation(period / turns, decay, float(amplitude), span * middle)
