"""Error of simulated stirs against the Navier-Stokes equations at the true parameters."""

import numpy as np

Steps = tuple[tuple[float, float], ...]
"""Viscosity below which each holds [Pa s], and an RMS error of the inclination [deg]."""

USUAL_ERRORS: Steps = ((0.03, 0.5), (0.08, 0.45), (0.2, 0.3), (np.inf, 0.05))
"""As measured on stars at 5 to 10 cm/s; a circle in water leaves 1.0."""
LARGEST_ERRORS: Steps = ((0.03, 0.6), (0.08, 0.55), (0.2, 0.36), (np.inf, 0.1))
"""What `make against` allows."""


def stirring_error(viscosity: float, errors: Steps = USUAL_ERRORS) -> float:
    """RMS error of the inclination in a liquid of so many Pa s [rad]; NaN where that is NaN."""
    degrees = next((error for limit, error in errors if viscosity < limit), np.nan)
    return float(np.radians(degrees))
