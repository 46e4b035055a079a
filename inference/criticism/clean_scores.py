"""Which effects a simulator seems to need even where nothing is missing."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .hypothesis import Hypothesis, samples, values_of
from .measurement_noise import Noise
from .signatures import Signature
from .usual_residual import usual_in, without_usual


def scored_on_clean(
    base: Hypothesis, noise: Noise, signatures: Mapping[str, Signature]
) -> dict[str, Signature]:
    """Signatures with the size of their scores on clean data of the same experiment, at least 1.

    Each clean residual is scored with the other residuals only; a single residual is not scored.
    Scores of either sign count: what errs one way on one liquid may err the other
    way on another. The mean square is by the shapes' weights, with a score of 1 besides.
    """
    usual = usual_in(noise)
    if usual is None:
        return dict(signatures)
    at = samples(base.fit.observed)
    measured = without_usual(noise).covariance(at)
    squares = dict.fromkeys(signatures, 1.0)
    parts = zip(usual.shapes_at(at), usual.leave_one_out(), usual.weights, strict=False)
    # one by one: where there are no others, there is nothing to learn from
    for shape, taught, weight in parts:
        if weight == 0.0:
            continue
        covariance = values_of(base, values_of(base, measured + taught.covariance(at)).T)
        others = replace(base, noise=covariance)
        left = others.project(others.whiten(values_of(base, shape[None])))[:, 0]
        for name, of in signatures.items():
            change = others.project(others.whiten(of.change))[:, 0]
            length = max(float(np.linalg.norm(change)), 1e-12)
            # a shape is its residual times the root of its weight
            squares[name] += float(change @ left / length) ** 2
    counted = 1.0 + float(usual.weights.sum())
    sizes = {name: max(1.0, (of / counted) ** 0.5) for name, of in squares.items()}
    return {name: of._replace(clean=sizes[name]) for name, of in signatures.items()}
