"""Constants of the discretisation."""

from dataclasses import dataclass

MODEL_VERSION = "2"  # rises with every change that alters a simulation's bits
POUR_PARTICLES = 664  # 5 mm apart in the bundled cups


@dataclass(frozen=True)
class Numerics:
    """How the liquid is cut into particles and steps; viscosity and cohesion are effective,
    given these, so they are fixed before inference and kept with every result.

    Attributes:
        rate: Substeps per second [Hz].
        iterations: Density iterations a substep.
        sweeps: Gauss-Seidel sweeps of the viscosity a substep.
        support: Kernel support radius h in particle spacings.
        compliance: Relaxation of the density constraint, in 1/h² (Macklin & Müller 2013, eq. 11).
        wall_slip: Factor on the tangential viscous coupling to walls, chosen on pours by an
            independent solver. Flow mirrored in the wall would explain 2 to 4 of it; the rest
            makes up for a wall that one layer of particles feels.
        wall_normal: The same factor for the normal direction.
        stick_drag: The same factor for the stick, which is about one particle wide.
        attraction: Acceleration of the surface attraction at cohesion 1 [m/s²].
        contact: Least distance of a particle's centre to a wall, in spacings.
    """

    rate: float = 240.0
    iterations: int = 2
    sweeps: int = 3
    support: float = 2.0
    compliance: float = 1.0
    wall_slip: float = 40.0
    wall_normal: float = 1.0
    stick_drag: float = 1.0
    attraction: float = 15.0
    contact: float = 0.25
