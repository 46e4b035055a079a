"""Error of simulated stirs against the Navier-Stokes equations at the true parameters."""

import numpy as np

Points = tuple[tuple[float, float], ...]
"""Viscosities [Pa s] and the RMS error of the inclination at each [deg]; constant beyond them, and
between two of them a power of the viscosity."""

USUAL_ERRORS: Points = (
    (0.03, 0.5),
    (0.05, 0.45),
    (0.1, 0.3),
    (0.3, 0.04),
    (1.0, 0.03),
    (6.0, 0.05),
)
"""As measured on stars at 5 to 10 cm/s; a circle in water leaves 1.0."""
LARGEST_ERRORS: Points = ((0.03, 0.6), (0.05, 0.55), (0.1, 0.36), (0.3, 0.1))
"""What `make against` allows."""


def stirring_error(viscosity: float, errors: Points = USUAL_ERRORS) -> float:
    """RMS error of the inclination in a liquid of so many Pa s [rad]; NaN where that is NaN."""
    known, degrees = np.log(np.transpose(errors))
    least = np.exp(known[0])  # as far as logarithms go
    return float(np.radians(np.exp(np.interp(np.log(max(viscosity, least)), known, degrees))))
