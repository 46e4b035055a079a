"""A uniform rod that hangs from a pivot at its upper end, in air or dipped into a liquid.

Rods are cylinders of length L, radius r and mass m [m, kg]. The pivot is the rod's own end, and
a liquid's surface lies at a height below it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ellipk

GRAVITY = 9.81


@dataclass(frozen=True)
class Rod:
    """A uniform cylinder [m, kg]."""

    length: float
    radius: float
    mass: float

    @property
    def inertia(self) -> float:
        """Moment of inertia about the end [kg m²]."""
        return self.mass * (self.length**2 / 3.0 + self.radius**2 / 4.0)

    @property
    def area(self) -> float:
        """Cross-section [m²]."""
        return np.pi * self.radius**2

    @property
    def density(self) -> float:
        """Mass per volume [kg/m³]."""
        return self.mass / (self.area * self.length)


def period_in_air(amplitude: ArrayLike, rod: Rod, gravity: float = GRAVITY) -> np.ndarray:
    """Period [s] of a plane swing from -amplitude to amplitude [rad].

    T = (2/π) K(sin²(θ/2)) T0, with the complete elliptic integral of the first kind (Landau &
    Lifshitz, Mechanics, section 11); at small amplitudes T0.
    """
    small = 2.0 * np.pi * np.sqrt(rod.inertia / (0.5 * rod.mass * gravity * rod.length))
    return small * (2.0 / np.pi) * ellipk(np.sin(0.5 * np.asarray(amplitude, float)) ** 2)


def added_mass_coefficient(radius: float, outer_radius: float = np.inf) -> float:
    """Added mass of a long cylinder over that of the liquid it displaces, in potential flow.

    1 in unbounded liquid; (R² + r²) / (R² - r²) in the middle of a cylinder of radius R (Stokes
    1843; Fritz 1972, J. Eng. Ind. 94, 167).
    """
    if np.isinf(outer_radius):
        return 1.0
    return (outer_radius**2 + radius**2) / (outer_radius**2 - radius**2)


def period_in_liquid(
    rod: Rod,
    submerged: float,
    density: float,
    *,
    added_mass: float = 1.0,
    gravity: float = GRAVITY,
) -> float:
    """Period [s] of small swings with the lower end dipped into a liquid without viscosity.

    Buoyancy weakens the torque and the added mass, taken slice by slice, adds inertia:
    ω² = g (m L/2 - ρ A s (L - s/2)) / (I + Ca ρ A (L³ - (L-s)³)/3). A surface that stays flat,
    which is so while the swing is slow against its waves.

    Args:
        submerged: Length s of the rod in the liquid [m].
        density: Of the liquid [kg/m³].
        added_mass: Ca.

    Raises:
        ValueError: buoyancy exceeds the weight's torque, so that the rod does not hang.
    """
    per_length = density * rod.area
    torque = 0.5 * rod.mass * rod.length - per_length * submerged * (rod.length - submerged / 2)
    if torque <= 0.0:
        raise ValueError("the rod floats up: its torque is less than its buoyancy's")
    wet = (rod.length**3 - (rod.length - submerged) ** 3) / 3.0
    inertia = rod.inertia + added_mass * per_length * wet
    return float(2.0 * np.pi * np.sqrt(inertia / (gravity * torque)))


def archimedes_torque(
    angle: ArrayLike, rod: Rod, surface: float, density: float, gravity: float = GRAVITY
) -> np.ndarray:
    """Torque [N m] of weight and buoyancy that turns the rod back to the vertical.

    The wet part of a thin rod displaces its own volume, and the lift acts at its middle
    (Archimedes, On Floating Bodies).

    Args:
        angle: From the downward vertical [rad].
        surface: Depth of the liquid's surface below the pivot [m].
        density: Of the liquid [kg/m³].
    """
    angle = np.asarray(angle, float)
    dry = np.minimum(surface / np.cos(angle), rod.length)
    lift = density * rod.area * 0.5 * (rod.length**2 - dry**2)
    return gravity * np.sin(angle) * (0.5 * rod.mass * rod.length - lift)


def floating_angle(rod: Rod, surface: float, density: float) -> float:
    """Angle from the vertical [rad] at which the rod floats; 0 where it hangs straight down.

    The root of `archimedes_torque`: cos θ = (surface / L) / sqrt(1 - ρ_rod / ρ).
    """
    share = 1.0 - rod.density / density
    if share <= 0.0:
        return 0.0
    cosine = surface / rod.length / np.sqrt(share)
    return float(np.arccos(cosine)) if cosine < 1.0 else 0.0
