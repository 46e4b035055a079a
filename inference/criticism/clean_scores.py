"""Which effects a simulator seems to need even where nothing is missing."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .hypothesis import Hypothesis, samples, values_of
from .noise import Noise
from .signatures import Signature
from .usual import usual_in


def scored_on_clean(
    base: Hypothesis, noise: Noise, signatures: Mapping[str, Signature]
) -> dict[str, Signature]:
    """Signatures with the size of their scores on clean data of the same experiment, at least 1.

    Each clean residual is scored by what the others teach, or it would excuse itself. One score
    of size 1, as it would be if they taught all, is counted with those of the clean data.
    """
    squares = {name: [1.0] for name in signatures}
    usual = usual_in(noise)
    shapes = [] if usual is None else usual.shapes_at(samples(base.fit.observed))
    for shape in values_of(base, np.asarray(shapes)) if len(shapes) else []:
        others = replace(base, noise=base.noise - np.outer(shape, shape))
        left = others.project(others.whiten(shape))[:, 0]
        for name, of in signatures.items():
            change = others.project(others.whiten(of.change))[:, 0]
            length = max(float(np.linalg.norm(change)), 1e-12)
            squares[name].append(float(change @ left / length) ** 2)
    sizes = {name: max(1.0, float(np.mean(of)) ** 0.5) for name, of in squares.items()}
    return {name: of._replace(clean=sizes[name]) for name, of in signatures.items()}
