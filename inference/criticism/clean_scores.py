"""Which effects a simulator seems to need even where nothing is missing."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .._float64 import in_float64
from .hypothesis import Hypothesis, values_of
from .measurement_noise import Noise, samples
from .signatures import Signature
from .usual_residual import model_error_part, without_model_error


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
