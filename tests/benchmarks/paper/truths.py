"""Liquids whose parameters are known, from water-like to gel-like."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bolfi_liquids.seeds import generator

from .phases import Phase

LIQUIDS = {"water": 0.005, "thin oil": 0.03, "oil": 0.15, "glycerin": 1.0, "gel": 10.0}
"""Median viscosity [Pa s] of each kind."""

LOG_VISCOSITY_SD = 0.2  # sd of the log of the viscosity within a kind
DENSITY = 1000.0  # kg/m3


class Truths(NamedTuple):
    """Drawn liquids, shape (n,) each.

    Attributes:
        liquid: Name of the kind.
        repetition: From 0.
        viscosity: [Pa s].
        cohesion: Uniform, because stirring data carry little information about it.
        seed: Of the data and of what is made of it.
    """

    liquid: NDArray[np.str_]
    repetition: NDArray[np.int64]
    viscosity: NDArray[np.float64]
    cohesion: NDArray[np.float64]
    seed: NDArray[np.int64]

    @property
    def theta(self) -> dict[str, NDArray[np.float64]]:
        """Parameters by name."""
        return {"viscosity": self.viscosity, "cohesion": self.cohesion}


def draw_truths(repetitions: int, seed: int) -> Truths:
    """Some of each kind; the first few are the same whatever the number."""
    rows = []
    for number, (name, median) in enumerate(LIQUIDS.items()):
        for repetition in range(repetitions):
            rng = generator(seed, Phase.TRUTHS, number, repetition)
            viscosity = median * np.exp(LOG_VISCOSITY_SD * rng.standard_normal())
            rows.append((name, repetition, viscosity, rng.uniform(), int(rng.integers(2**31))))
    return Truths(*map(np.array, zip(*rows, strict=True)))
