"""Small swings of a rod that dips into a viscous liquid."""

from typing import NamedTuple

import numpy as np
from scipy.special import ive, kve

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


def stokes_reaction_in_cup(
    radius: float, cup_radius: float, angular_frequency: float, kinematic: float
) -> Reaction:
    """Force on a long cylinder that oscillates in the middle of a cup, with a small amplitude.

    The liquid sticks to both. With lengths over r, the stream function is
    (A x + B/x + C I1(z x) + D K1(z x)) sin θ, z = r sqrt(i ω/ν); A to D follow from no slip at
    x = 1 and at the cup, and the reaction is 2 B - 1. Chen, Wambsganss & Jendrzejczyk 1976 (J.
    Appl. Mech. 43, 325) treat the same flow. Right to six digits while r and the cup's radius R
    keep ω R²/ν above 1e-3.

    Args:
        radius: r [m].
        cup_radius: R [m].
        angular_frequency: ω [rad/s].
        kinematic: ν [m²/s].

    Raises:
        ValueError: the cup is not wider than the cylinder.
    """
    if not 0.0 < radius < cup_radius:
        raise ValueError(f"the radius must be 0 to the cup's, {cup_radius} m, got {radius} m")
    z = radius * np.sqrt(1j * angular_frequency / kinematic)
    outer = cup_radius / radius
    rows = [*_no_slip(1.0, z, outer), *_no_slip(outer, z, outer)]
    b = np.linalg.solve(np.array(rows), np.array([1.0, 1.0, 0.0, 0.0]))[1]
    reaction = 2.0 * b - 1.0
    return Reaction(float(reaction.real), float(-reaction.imag))


def _no_slip(x: float, z: complex, outer: float) -> tuple[list[complex], list[complex]]:
    """The four parts of the stream function at x, and their derivatives.

    The Bessel functions are 1 or so where they are largest: I1 at the cup, K1 at the cylinder.
    """
    growth, decay = np.exp(z.real * (x - outer)), np.exp(-z * (x - 1.0))
    i0, i1 = ive(0, z * x) * growth, ive(1, z * x) * growth
    k0, k1 = kve(0, z * x) * decay, kve(1, z * x) * decay
    return (
        [x, 1.0 / x, i1, k1],
        [1.0, -1.0 / x**2, z * i0 - i1 / x, -z * k0 - k1 / x],
    )


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
