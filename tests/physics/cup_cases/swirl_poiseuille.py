"""Flow around a cup's axis that a force everywhere keeps up, against the wall's friction."""

import numpy as np
from case import Case, CaseResult

from . import _driven


def everywhere(r: np.ndarray) -> np.ndarray:
    """Acceleration around the axis like the distance from it, as in a cup that speeds up."""
    return r


def run(seed: int) -> CaseResult:
    """Sizes of the flow at each viscosity."""
    return _driven.compare(everywhere, seed)


CASE = Case(
    truth="a profile R² r - r³, of a size as the force over the viscosity",
    source="Batchelor 1967, section 4.5, for a force that grows with the radius",
    unit="relative",
    run=run,
)
