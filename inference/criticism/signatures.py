"""What an effect looks like in the data, and which effects look alike."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .._float64 import in_float64
from .extension import Extension
from .hypothesis import Hypothesis

STEPS = np.array([0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9])  # of prior quantiles
VISIBLE = 5.0  # signal-to-noise ratio at which a signature is taken
FAINT = 0.3  # length below which what is left of a direction means nothing


class Signature(NamedTuple):
    """Whitened change of the data, less what the base parameters absorb.

    Attributes:
        direction: Of length one [m].
        coefficient: Typical of the prior: halfway in quantiles from neutral to its farther end.
        snr: Signal-to-noise ratio of an effect of that size.
    """

    direction: np.ndarray
    coefficient: float
    snr: float


@in_float64
def signature(base: Hypothesis, extended: Hypothesis, extension: Extension) -> Signature:
    """Of the effect by which `extended` goes beyond `base`.

    Secants rather than a slope: runs are noisy, so an effect is taken where one would see it.
    """
    prior = extended.fit.prior
    (name,) = extended.names
    at = {key: np.asarray(value) for key, value in base.best.items()}
    neutral = float(prior.to_unit({**at, name: np.asarray(extension.neutral)})[-1])
    units = []
    for side in (-1.0, 1.0):
        u = neutral + side * STEPS
        u = u[(u >= 0.01) & (u <= 0.99)]
        if len(u):
            white = _changes(base, extended, neutral, u)
            length = np.maximum(np.linalg.norm(white, axis=0), 1e-12)
            nearest = np.argmin(np.abs(np.log(length / VISIBLE)))
            units.append(side * white[:, nearest] / length[nearest])
    mean = np.mean(units, axis=0)
    middle = (neutral + float(neutral <= 0.5)) / 2.0
    typical = _changes(base, extended, neutral, np.array([middle]))
    return Signature(
        mean / max(float(np.linalg.norm(mean)), 1e-12),
        float(prior.from_unit(np.append(base.u, middle))[name]),
        float(np.linalg.norm(typical)),
    )


def _changes(base: Hypothesis, extended: Hypothesis, neutral: float, u: np.ndarray) -> np.ndarray:
    """What coefficients at prior quantiles u [n] change, whitened and projected [m, n]."""
    points = np.column_stack([np.tile(base.u, (len(u) + 1, 1)), np.append(neutral, u)])
    expected = extended.expected(points)
    return base.project(base.whiten(expected[1:] - expected[0]))


def directions(
    hypothesis: Hypothesis, signatures: Mapping[str, Signature]
) -> dict[str, np.ndarray]:
    """Signatures of the effects that do not act yet, as far as a hypothesis leaves them:
    name -> unit vector [m]. What it absorbs nearly whole is left out."""
    found = {}
    for name, of in signatures.items():
        if name in hypothesis.names:
            continue
        left = hypothesis.project(of.direction[:, None])[:, 0]
        length = np.linalg.norm(left)
        if length > FAINT:
            found[name] = left / length
    return found


def confusion(signatures: Mapping[str, Signature]) -> np.ndarray:
    """Cosines between all signatures [e, e]: 1 is the same, 0 nothing in common."""
    if not signatures:
        return np.zeros((0, 0))
    rows = np.stack([of.direction for of in signatures.values()])
    return rows @ rows.T
