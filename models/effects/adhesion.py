"""Wetting of the cup beyond its written contact angle."""

import numpy as np

from ..effect import Effect, prior_of


def _wet(cosine: np.ndarray, coefficient: np.ndarray) -> np.ndarray:
    return cosine + coefficient


EFFECT = Effect(
    name="adhesion",
    unit="1",
    neutral=0.0,
    acts_in="liquid",
    text="The liquid wets the cup more than its contact angle says, or less: the coefficient is "
    "added to the angle's cosine, and stirs do not show it.",
    source="Young 1805 (Phil. Trans. R. Soc. 95, 65): the cosine is the work of adhesion over the "
    "surface tension, less 1 (Dupre 1869)",
    make_prior=prior_of("Uniform", -1.0, 1.0),
    wetting=_wet,
    lowest=-2.0,
    highest=2.0,
)
