"""How far simulated stirs are from the Navier-Stokes equations."""

import numpy as np

LARGEST_ERRORS = ((0.03, 0.6), (0.08, 0.55), (0.2, 0.36), (np.inf, 0.1))
"""Viscosity below which each holds [Pa s], and the largest RMS error of the inclination [deg], at
the true parameters: `check physics --against` measures it on recordings of a reference solver."""


def stirring_error(viscosity: float) -> float:
    """Largest RMS error of the inclination of a liquid of so many Pa s [rad]."""
    degrees = next((error for limit, error in LARGEST_ERRORS if viscosity < limit), np.nan)
    return float(np.radians(degrees))
