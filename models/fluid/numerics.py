"""Constants of the discretisation."""

from dataclasses import asdict, dataclass

from .checks import check_numbers

MODEL_VERSION = "8"  # rises with every change that alters a simulation's bits
COARSE = 0.0065  # m, the particle spacing that `ParticleNumerics.rate` is for
FLOOR_AT_REST = 2.2e-3  # least kinematic viscosity of slow flow, in d² a substep
FLOOR_OF_SPEED = 0.018  # what flow at a speed U past walls adds to it, in U d
STIR_PARTICLES = 1000


@dataclass(frozen=True)
class ParticleNumerics:
    """How the liquid is cut into particles and steps; viscosity and cohesion are effective,
    given these, so they are fixed before inference and kept with every result.

    Attributes:
        rate: Substeps per second at 6.5 mm between particles [Hz]; smaller ones take more, since
            pressure makes them swing about each other faster.
        iterations: Sweeps over the density constraints a substep.
        feedback: Share of a density error that a substep corrects.
        memory: Share of the last substep's multipliers that the next one starts from.
        viscous_tolerance: Of the viscous solve, relative to its first residual.
        support: Kernel support radius h in particle spacings.
        quiet: Least kinematic viscosity, in d² of a substep: what keeps thin liquids at rest.
        own_viscosity: Kinematic viscosity that the particles' disorder adds, in d² of a substep.
        viscosity_gain: Factor on the viscosity of pairs; with the former chosen such that
            channel flow has the viscosity asked for.
        wall_slip: Factor on the tangential viscous coupling to walls.
        wall_normal: The same factor for the normal direction.
        wall_friction: Stress on a pouring cup by the speed at which liquid slips along it, at
            most [Pa s/m], adhesion aside: above 1 Pa s or so liquids slip (Navier 1823). Tuned on
            pours of a gel; plates and the stirred cup have none.
        outer_wall: Factor on the tangential coupling to walls of what runs over a pouring cup's
            rim and down outside, where nothing presses it on. Tuned, with the next, on pours.
        outer_viscosity: Kinematic viscosity above which that slips [m²/s].
        stick_drag: Factor on the viscous coupling to the stick, about one particle wide.
        stick_thinner: How much less than its own the stick's radius is to the particles, in
            spacings; see `PUBLISHED_DRAG`.
        attraction: Acceleration towards a unit of kernel-sum gradient at cohesion 1 [m/s²].
        contact: Least distance of a particle's centre to a wall, in spacings.
    """

    rate: float = 160.0
    iterations: int = 2
    feedback: float = 0.5
    memory: float = 0.8
    viscous_tolerance: float = 0.03
    support: float = 2.12
    quiet: float = 1.5e-3
    own_viscosity: float = 2.3e-3
    viscosity_gain: float = 1.43
    wall_slip: float = 4.5
    wall_normal: float = 1.0
    wall_friction: float = 900.0
    outer_wall: float = 1.6
    outer_viscosity: float = 1e-4
    stick_drag: float = 1.0
    stick_thinner: float = 0.05
    attraction: float = 2.25
    contact: float = 0.25

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            ValueError: a number is not finite or negative, or a rate, size or count is 0.
        """
        numbers = asdict(self)
        needed = {name: numbers.pop(name) for name in ("rate", "iterations", "support")}
        check_numbers("numerics", **needed)
        check_numbers("numerics", zero=True, **numbers)

    def substep_rate(self, spacing: float) -> float:
        """Substeps per second [Hz] for particles `spacing` [m] apart."""
        return self.rate * COARSE / spacing

    def stick_core(self, radius: float, spacing: float) -> float:
        """Radius [m] that a stick of `radius` [m] has to the particles."""
        return max(radius - self.stick_thinner * spacing, 0.2 * radius)

    def least_viscosity(self, spacing: float, density: float, speed: float = 0.1) -> float:
        """Viscosity [Pa s] below which particles flow alike, and liquids cannot be told apart.

        Measured without gravity in channels twelve particles wide (validation case `poiseuille`).
        It rises with speed, as particles that pass each other pick up disorder, and, beyond what
        this says, with the pressure that they bear.

        Args:
            spacing: Particle spacing [m].
            density: Of the liquid [kg/m³].
            speed: Of the flow [m/s].
        """
        at_rest = FLOOR_AT_REST * spacing**2 * self.substep_rate(spacing)
        return density * (at_rest + FLOOR_OF_SPEED * speed * spacing)


# The default stick drags like that of the solver that made the bundled recordings of version 0.1:
# 1.4 to 2.5 times as towed rods do at Reynolds 1 to 100. This one is within 28 % of them at 6.5 mm
# (validation case `cylinder_drag`).
PUBLISHED_DRAG = ParticleNumerics(stick_thinner=0.3, stick_drag=0.5)
