"""Liquids at rest, and drops that oscillate."""

import numpy as np

GRAVITY = 9.81


def column_frequency(radius: float, *, tension: float, density: float, mode: int = 2) -> float:
    """Frequency [Hz] of small oscillations across a round column of liquid, alike along it.

    Rayleigh 1879 (Proc. R. Soc. 29, 71): ω² = n (n² - 1) σ / (ρ R³).

    Args:
        tension: Surface tension σ [N/m].
        mode: n, 2 for an ellipse.
    """
    squared = mode * (mode**2 - 1) * tension / (density * radius**3)
    return float(np.sqrt(squared) / (2.0 * np.pi))
