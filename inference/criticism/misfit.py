"""Whether a fitted model and the data disagree, and where."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from ..surrogates.measurement_noise import Layout
from .hypothesis import Hypothesis, values_of
from .measurement_noise import Noise, gaussian, samples
from .signatures import Signature, directions

ACCEPTANCE_LEVEL = 0.01  # p-value above which an extended model is not rejected
REPLICATES = 999  # of the parametric bootstrap
MODES_PER_CHANNEL = 36  # of each channel: slower than these is what simulators get wrong
WINDOW_MODES = 3


class Window(NamedTuple):
    """Samples that are looked at together.

    Attributes:
        label: What they have in common, for a person and for tables.
        samples: Which of the observed, bool [*signal_shape].
    """

    label: Mapping[str, object]
    samples: np.ndarray


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
    return hypothesis.project(hypothesis.whiten(measured + simulated))


@in_float64
def check(hypothesis: Hypothesis, signatures: Mapping[str, Signature], null: np.ndarray) -> Check:
    """Test a model against the data.

    What the simulator seems to need on clean data as well is not missing here: scores are
    divided by those. A score on the side on which an effect cannot act speaks for nothing.

    Args:
        signatures: Of the effects; those that act in the model already do not count.
        null: Residuals [m, n] if it were right, see `null_draws`.
    """
    residual = hypothesis.project(hypothesis.whiten(hypothesis.difference))
    series = hypothesis.surrogate.output.long
    modes = slow_modes(hypothesis.layout, MODES_PER_CHANNEL) if series else np.eye(len(residual))
    span = orthonormal(hypothesis.project(hypothesis.whiten(modes.T)))
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
    residual = hypothesis.project(hypothesis.whiten(hypothesis.difference))
    seen: list[tuple[Mapping[str, object], float, float]] = []
    sizes, usual = [], []
    kept = [w for w in windows if w.samples.ravel()[output.present].any()]
    for window in kept:
        inside = output.average(window.samples.ravel()[output.present].astype(float)) > 0.5
        if not inside.any():
            first = np.argmax(window.samples.ravel()[output.present])
            inside[np.searchsorted(output.starts, first, "right") - 1] = True
        count = WINDOW_MODES if output.long else 1
        modes = slow_modes(hypothesis.layout, count, inside)
        span = orthonormal(hypothesis.project(hypothesis.whiten(modes.T)))
        sizes.append(float(np.sum((span.T @ residual) ** 2)))
        usual.append(np.sum((span.T @ null) ** 2, 0))
        rms = float(np.sqrt(np.mean(hypothesis.difference[inside] ** 2)))
        mean = hypothesis.project(hypothesis.whiten(inside.astype(float)))[:, 0]
        z = float(mean @ residual[:, 0]) / max(float(np.linalg.norm(mean)), 1e-12)
        seen.append((window.label, rms, z))
    if not kept:
        return []
    alone = exceedance(np.stack(usual), np.array(sizes))
    least = _own_exceedance(np.stack(usual)).min(0)
    together = exceedance(-np.tile(least, (len(alone), 1)), -alone)
    return [
        Found(label, rms, z, float(p)) for (label, rms, z), p in zip(seen, together, strict=True)
    ]


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
    """Of each draw among its own kind, [k, n]; ties count as in `exceedance`."""
    count = usual.shape[1]
    smaller = [np.searchsorted(np.sort(row), row - 1e-12) for row in usual]
    return (count - np.stack(smaller)) / (count + 1.0)
