"""Signatures: the change that each effect makes to the data, and how alike they are."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from .hypothesis import Hypothesis, values_of
from .measurement_noise import Noise, samples
from .model_extension import Extension
from .usual_residual import model_error_part, without_model_error

QUANTILE_STEPS = np.array(
    [0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9]
)  # of prior quantiles
VISIBLE_SNR = 5.0  # signal-to-noise ratio at which a signature is taken
FAINT_SHARE = 0.3  # a change shorter than this share of its visible length counts as none


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
def signature(base: Hypothesis, extended: Hypothesis, extension: Extension) -> Signature:
    """Of the effect by which `extended` goes beyond `base`.

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
            changes = _changes(base, extended, neutral, u)
            length = np.maximum(_visible(base, changes), 1e-12)
            nearest = np.argmin(np.abs(np.log(length / VISIBLE_SNR)))
            units[side] = side * changes[nearest] / length[nearest]
    change = np.mean(list(units.values()), axis=0)
    middle = (neutral + float(neutral <= 0.5)) / 2.0
    typical = _changes(base, extended, neutral, np.array([middle]))
    return Signature(
        change,
        float(_visible(base, change[None])[0]),
        float(prior.from_unit(np.append(base.u, middle))[name]),
        float(_visible(base, typical)[0]),
        side=sum(units),  # of both sides, 0
    )


def _changes(base: Hypothesis, extended: Hypothesis, neutral: float, u: np.ndarray) -> np.ndarray:
    """Changes of the expected values [n, m] due to coefficients at prior quantiles u [n]."""
    points = np.column_stack([np.tile(base.u, (len(u) + 1, 1)), np.append(neutral, u)])
    expected = extended.expected(points)
    return expected[1:] - expected[0]


def _visible(base: Hypothesis, changes: np.ndarray) -> np.ndarray:
    """Signal-to-noise ratios of changes [n, m] that the base parameters do not absorb [n]."""
    return np.linalg.norm(base.project(base.whiten(changes)), axis=0)


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
        left = hypothesis.project(hypothesis.whiten(of.change))[:, 0]
        length = np.linalg.norm(left)
        if length > FAINT_SHARE * of.visible:
            found[name] = left / length
    return found


def confusion(base: Hypothesis, signatures: Mapping[str, Signature]) -> np.ndarray:
    """Cosines between all signatures [e, e]: 1 is the same, 0 nothing in common."""
    if not signatures:
        return np.zeros((0, 0))
    white = base.project(base.whiten(np.stack([of.change for of in signatures.values()])))
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
    error = model_error_part(noise)
    if error is None:
        return dict(signatures)
    output, at = base.surrogate.output, samples(base.fit.observed)
    measured = without_model_error(noise).covariance(at)
    squares = dict.fromkeys(signatures, 1.0)
    counted = 1.0
    for clean, weight, taught in error.leave_one_out():
        covariance = output.average_covariance(measured + taught.covariance(at))
        others = replace(base, noise=covariance)
        unexpected = values_of(output, (clean.values(at) - taught.mean(at))[None])
        left = others.project(others.whiten(unexpected))[:, 0]
        for name, of in signatures.items():
            change = others.project(others.whiten(of.change))[:, 0]
            length = max(float(np.linalg.norm(change)), 1e-12)
            squares[name] += weight * float(change @ left / length) ** 2
        counted += weight
    sizes = {name: max(1.0, (of / counted) ** 0.5) for name, of in squares.items()}
    return {name: of._replace(clean=sizes[name]) for name, of in signatures.items()}
