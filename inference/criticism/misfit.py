"""Tests of a fitted model: do it and the data disagree, where, and as which effect would?"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from ..surrogates.measurement_noise import Layout
from .experiment import Extension, Window
from .hypothesis import Hypothesis, values_of
from .measurement_noise import Noise, gaussian, samples
from .model_errors import split_noise

ACCEPTANCE_LEVEL = 0.01  # p-value above which an extended model is not rejected
REPLICATES = 999  # of the parametric bootstrap
MODES_PER_CHANNEL = 36  # of each channel: slower than these is what simulators get wrong
WINDOW_MODES = 3
QUANTILE_STEPS = np.array([0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9])
VISIBLE_SNR = 5.0  # signal-to-noise ratio at which a signature is taken
FAINT_SHARE = 0.3  # a change shorter than this share of its visible length counts as none


class Found(NamedTuple):
    """Disagreement of a model and the data in a window.

    Attributes:
        label: The window's.
        rms: Of observed less expected.
        z: Its mean over the mean's standard deviation.
        p_value: That a right model disagrees as much in any of the windows.
    """

    label: Mapping[str, object]
    rms: float
    z: float
    p_value: float


class Check(NamedTuple):
    """Test of a model against the data.

    Attributes:
        p_value: That a right model is as far; the smaller of the next two, corrected for
            there being two.
        p_score: By the largest score of an effect, corrected for there being several.
        p_smooth: By the slow part of the residual, whatever its shape.
        scores: Effect -> score, positive for a greater coefficient; standard normal if it does
            not act, and smaller where clean data have large scores, too.
    """

    p_value: float
    p_score: float
    p_smooth: float
    scores: dict[str, float]


class Signature(NamedTuple):
    """Change of the data by an effect.

    Attributes:
        change: Of the expected values, any size [m].
        visible: Its length where the base model is fitted: whitened, and less what the base
            parameters absorb.
        coefficient: Typical of the prior: halfway in quantiles from neutral to its farther end.
        snr: Signal-to-noise ratio of an effect of that size.
        side: 1 or -1 where the coefficient can only be above or below neutral; else 0.
        clean: Size of the effect's score on clean data, see `scored_on_clean`.
    """

    change: np.ndarray
    visible: float
    coefficient: float
    snr: float
    side: int = 0
    clean: float = 1.0


@in_float64
def null_draws(
    hypothesis: Hypothesis, noise: Noise, rng: np.random.Generator, count: int = REPLICATES
) -> np.ndarray:
    """Whitened residuals [m, count] of the model if it were right.

    Noise is drawn with the sizes that it may have, and whitened with the size that it is
    thought to have: so a noise that is badly known makes no discoveries.
    """
    observed = hypothesis.fit.observed
    measured = values_of(hypothesis.surrogate.output, noise.draw(rng, samples(observed), count))
    simulated = gaussian(rng, hypothesis.spread, count)
    return hypothesis.visible(measured + simulated)


@in_float64
def check(hypothesis: Hypothesis, signatures: Mapping[str, Signature], null: np.ndarray) -> Check:
    """Test a model against the data.

    What the simulator seems to need on clean data as well is not missing here: scores are
    divided by those. A score on the side on which an effect cannot act speaks for nothing.

    Args:
        signatures: Of the effects; those that act in the model already do not count.
        null: Residuals [m, n] if it were right, see `null_draws`.
    """
    residual = hypothesis.visible(hypothesis.difference)
    modes = judged_modes(hypothesis.layout, hypothesis.surrogate.output.long)
    span = orthonormal(hypothesis.visible(modes.T))
    unused = directions(hypothesis, signatures)
    rows = np.stack(list(unused.values())) if unused else np.zeros((0, len(residual)))
    side = np.array([[signatures[name].side] for name in unused]).reshape(-1, 1)
    clean = np.array([[signatures[name].clean] for name in unused]).reshape(-1, 1)
    scores = rows @ residual / clean

    def measures(found: np.ndarray, white: np.ndarray) -> np.ndarray:
        credited = np.where(side, side * found, np.abs(found))
        return np.stack([credited.max(0, initial=0.0), np.sum((span.T @ white) ** 2, 0)])

    seen, usual = measures(scores, residual)[:, 0], measures(rows @ null, null)
    p_score, p_smooth = exceedance(usual, seen)
    together = exceedance(-_own_exceedance(usual).min(0)[None], [-min(p_score, p_smooth)])[0]
    named = dict(zip(unused, scores[:, 0].tolist(), strict=True))
    return Check(float(together), float(p_score), float(p_smooth), named)


@in_float64
def locate(hypothesis: Hypothesis, windows: Sequence[Window], null: np.ndarray) -> list[Found]:
    """Test the residual in each window, with one error rate for all windows (max statistic).

    In each window the slow part of the residual is looked at.
    """
    output = hypothesis.surrogate.output
    residual = hypothesis.visible(hypothesis.difference)
    found: list[Found] = []
    sizes, usual = [], []
    for window in windows:
        there = window.samples.ravel()[output.present]
        if not there.any():
            continue
        inside = output.average(there.astype(float)) > 0.5
        if not inside.any():
            inside[np.searchsorted(output.starts, np.argmax(there), "right") - 1] = True
        modes = slow_modes(hypothesis.layout, WINDOW_MODES if output.long else 1, inside)
        span = orthonormal(hypothesis.visible(modes.T))
        sizes.append(float(np.sum((span.T @ residual) ** 2)))
        usual.append(np.sum((span.T @ null) ** 2, 0))
        rms = float(np.sqrt(np.mean(hypothesis.difference[inside] ** 2)))
        mean = hypothesis.visible(inside.astype(float))[:, 0]
        z = float(mean @ residual[:, 0]) / max(float(np.linalg.norm(mean)), 1e-12)
        found.append(Found(window.label, rms, z, np.nan))
    if not found:
        return []
    alone = exceedance(np.stack(usual), np.array(sizes))
    least = _own_exceedance(np.stack(usual)).min(0)
    together = exceedance(-np.tile(least, (len(alone), 1)), -alone)
    return [one._replace(p_value=float(p)) for one, p in zip(found, together, strict=True)]


def judged_modes(layout: Layout, series: bool) -> np.ndarray:
    """Directions [m, n] in which models are judged: of a series slow ones, else each value."""
    return slow_modes(layout, MODES_PER_CHANNEL) if series else np.eye(len(layout.sample))


def slow_modes(layout: Layout, count: int, inside: np.ndarray | None = None) -> np.ndarray:
    """Cosines over the samples of each channel [m, channels * count], only `inside` [m]."""
    columns = []
    inside = np.ones(len(layout.sample), bool) if inside is None else inside
    for channel in np.unique(layout.channel[inside]):
        here = inside & (layout.channel == channel)
        order = np.cumsum(here) - 0.5
        for k in range(min(count, int(here.sum()))):
            columns.append(np.where(here, np.cos(np.pi * k * order / here.sum()), 0.0))
    return np.stack(columns, axis=1)


def orthonormal(columns: np.ndarray) -> np.ndarray:
    """A basis of what columns [m, n] span."""
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return left[:, size > 1e-6 * size[0]]


def exceedance(usual: np.ndarray, seen: np.ndarray | list[float]) -> np.ndarray:
    """Share of draws [k, n] at least as large as what was seen [k], itself counted."""
    above = np.sum(usual >= np.asarray(seen)[:, None] - 1e-12, axis=1)
    return (1.0 + above) / (usual.shape[1] + 1.0)


def _own_exceedance(usual: np.ndarray) -> np.ndarray:
    """Exceedance of each draw among its own kind [k, n]; ties count as in `exceedance`."""
    count = usual.shape[1]
    smaller = [np.searchsorted(np.sort(row), row - 1e-12) for row in usual]
    return (count - np.stack(smaller)) / (count + 1.0)


@in_float64
def signature(base: Hypothesis, extended: Hypothesis, extension: Extension) -> Signature:
    """Signature of the effect by which `extended` goes beyond `base`.

    Secants rather than a slope: runs are noisy, so an effect is taken where one would see it.
    """
    prior = extended.fit.prior
    (name,) = extended.names
    at = {key: np.asarray(value) for key, value in base.best.items()}
    neutral = float(prior.to_unit({**at, name: np.asarray(extension.neutral)})[-1])
    units = {}
    for side in (-1, 1):
        u = neutral + side * QUANTILE_STEPS
        u = u[(u >= 0.01) & (u <= 0.99)]
        if len(u):
            changes = changes_of(base, extended, neutral, u)
            length = np.maximum(snr_of(base, changes), 1e-12)
            nearest = np.argmin(np.abs(np.log(length / VISIBLE_SNR)))
            units[side] = side * changes[nearest] / length[nearest]
    change = np.mean(list(units.values()), axis=0)
    middle = (neutral + float(neutral <= 0.5)) / 2.0
    typical = changes_of(base, extended, neutral, np.array([middle]))
    return Signature(
        change,
        float(snr_of(base, change[None])[0]),
        float(prior.from_unit(np.append(base.u, middle))[name]),
        float(snr_of(base, typical)[0]),
        side=sum(units),  # of both sides, 0
    )


def changes_of(base: Hypothesis, extended: Hypothesis, neutral: float, u: np.ndarray) -> np.ndarray:
    """Changes of the expected values [n, m] due to coefficients at prior quantiles u [n]."""
    points = np.column_stack([np.tile(base.u, (len(u) + 1, 1)), np.append(neutral, u)])
    expected = extended.expected(points)
    return expected[1:] - expected[0]


def snr_of(base: Hypothesis, changes: np.ndarray) -> np.ndarray:
    """Signal-to-noise ratios of changes [n, m] that the base parameters do not absorb [n]."""
    return np.linalg.norm(base.visible(changes), axis=0)


def directions(
    hypothesis: Hypothesis, signatures: Mapping[str, Signature]
) -> dict[str, np.ndarray]:
    """Whitened signatures of the effects that do not act yet, as far as a hypothesis leaves them:
    name -> unit vector [m], towards a greater coefficient. What it absorbs nearly whole is left
    out."""
    found = {}
    for name, of in signatures.items():
        if name in hypothesis.names:
            continue
        left = hypothesis.visible(of.change)[:, 0]
        length = np.linalg.norm(left)
        if length > FAINT_SHARE * of.visible:
            found[name] = left / length
    return found


def confusion(base: Hypothesis, signatures: Mapping[str, Signature]) -> np.ndarray:
    """Cosines between all signatures [e, e]: 1 is the same, 0 nothing in common."""
    if not signatures:
        return np.zeros((0, 0))
    white = base.visible(np.stack([of.change for of in signatures.values()]))
    rows = white.T / np.maximum(np.linalg.norm(white, axis=0), 1e-12)[:, None]
    return rows @ rows.T


@in_float64
def scored_on_clean(
    base: Hypothesis, noise: Noise, signatures: Mapping[str, Signature]
) -> dict[str, Signature]:
    """Signatures with the size of their scores on clean data of the same experiment, at least 1.

    Each clean residual is scored with the other residuals only, less what they lead to expect of
    it; one whose regime they do not tell of is not scored. Scores of either sign count: what errs
    one way in one regime may err the other way in another. The mean square is by how alike the
    regimes are, with a score of 1 besides.
    """
    measurement, error = split_noise(noise)
    if error is None:
        return dict(signatures)
    output, at = base.surrogate.output, samples(base.fit.observed)
    measured = measurement.covariance(at)
    squares = dict.fromkeys(signatures, 1.0)
    counted = 1.0
    for clean, weight, taught in error.leave_one_out():
        covariance = output.average_covariance(measured + taught.covariance(at))
        others = replace(base, noise=covariance)
        unexpected = values_of(output, (clean.values(at) - taught.mean(at))[None])
        left = others.visible(unexpected)[:, 0]
        for name, of in signatures.items():
            change = others.visible(of.change)[:, 0]
            length = max(float(np.linalg.norm(change)), 1e-12)
            squares[name] += weight * float(change @ left / length) ** 2
        counted += weight
    sizes = {name: max(1.0, (of / counted) ** 0.5) for name, of in squares.items()}
    return {name: of._replace(clean=sizes[name]) for name, of in signatures.items()}
