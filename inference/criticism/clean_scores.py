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
    way on another. With K of them the mean square is that of K + 1 scores, one of which is 1.
    """
    usual = usual_in(noise)
    if usual is None:
        return dict(signatures)
    at = samples(base.fit.observed)
    measured = without_usual(noise).covariance(at)
    squares = {name: [1.0] for name in signatures}
    # one by one: where there are no others, there is nothing to learn from
    for shape, taught in zip(usual.shapes_at(at), usual.leave_one_out(), strict=False):
        covariance = values_of(base, values_of(base, measured + taught.covariance(at)).T)
        others = replace(base, noise=covariance)
        left = others.project(others.whiten(values_of(base, shape[None])))[:, 0]
        for name, of in signatures.items():
            change = others.project(others.whiten(of.change))[:, 0]
            length = max(float(np.linalg.norm(change)), 1e-12)
            squares[name].append(float(change @ left / length) ** 2)
    sizes = {name: max(1.0, float(np.mean(of)) ** 0.5) for name, of in squares.items()}
    return {name: of._replace(clean=sizes[name]) for name, of in signatures.items()}
