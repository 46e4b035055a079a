"""Small swings of a rod that dips into a viscous liquid."""

from typing import NamedTuple

import numpy as np
from scipy.special import kve

from .pendulum import GRAVITY, Rod, added_mass_coefficient, period_in_liquid

ROUNDS = 20  # of frequency and added mass in turn; each gains a digit


class Reaction(NamedTuple):
    """Of the liquid on a cylinder that oscillates across itself, over that displaced.

    Attributes:
        added_mass: In phase with the acceleration.
        damping: In phase with the velocity, over the angular frequency.
    """

    added_mass: float
    damping: float


class Swing(NamedTuple):
    """Period [s] and decay of the amplitude [1/s]."""

    period: float
    decay: float


def stokes_reaction(radius: float, angular_frequency: float, kinematic: float) -> Reaction:
    """Force on a long cylinder that oscillates with a small amplitude in unbounded liquid.

    Stokes 1851 (Trans. Camb. Phil. Soc. 9, 8), in modified Bessel functions:
    1 + 4 K1(z) / (z K0(z)), z = r sqrt(i ω/ν).

    Args:
        radius: r [m].
        angular_frequency: ω [rad/s].
        kinematic: ν [m²/s].
    """
    z = radius * np.sqrt(1j * angular_frequency / kinematic)
    reaction = 1.0 + 4.0 * kve(1, z) / (z * kve(0, z))
    return Reaction(float(reaction.real), float(-reaction.imag))


def swing_in_liquid(
    rod: Rod,
    submerged: float,
    *,
    density: float,
    viscosity: float,
    outer_radius: float = np.inf,
    gravity: float = GRAVITY,
) -> Swing:
    """Period and decay of small swings with the lower end dipped into a viscous liquid.

    `stokes_reaction` slice by slice, at the frequency that results from it; the walls of a cup
    add what they add in potential flow. Right while the liquid's boundary layer, sqrt(2 ν/ω),
    stays clear of them, the decay is slow against the swing, and the path of the tip is short
    against the rod's diameter.

    Args:
        submerged: Length in the liquid [m].
        density, viscosity: Of the liquid [kg/m³, Pa s].
        outer_radius: Of the cup around it [m].
    """
    walls = added_mass_coefficient(rod.radius, outer_radius) - 1.0
    period, reaction = period_in_liquid(rod, submerged, density, gravity=gravity), Reaction(1, 0)
    for _ in range(ROUNDS):
        reaction = stokes_reaction(rod.radius, 2.0 * np.pi / period, viscosity / density)
        period = period_in_liquid(
            rod, submerged, density, added_mass=reaction.added_mass + walls, gravity=gravity
        )
    wet = density * rod.area * (rod.length**3 - (rod.length - submerged) ** 3) / 3.0
    inertia = rod.inertia + (reaction.added_mass + walls) * wet
    return Swing(period, 0.5 * reaction.damping * wet * 2.0 * np.pi / period / inertia)
