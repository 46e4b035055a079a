"""Flow in a cup that a driven ring of liquid drags around, as a turning cylinder does."""

import numpy as np
from case import Case, CaseResult

from . import _driven

RING = (0.0225, 0.0275)  # m, of the driven liquid: one cell


def in_the_ring(r: np.ndarray) -> np.ndarray:
    """Acceleration around the axis, 1 within the ring."""
    return ((r >= RING[0]) & (r <= RING[1])).astype(float)


def run(seed: int) -> CaseResult:
    """Sizes of the flow at each viscosity."""
    return _driven.compare(in_the_ring, seed)


CASE = Case(
    truth="rigid rotation within the ring, R²/r - r outside, as fast as torque over viscosity",
    source="Batchelor 1967, section 4.5: flow between cylinders",
    unit="relative",
    run=run,
)
