"""What is stirred, with what, and how finely it is resolved."""

import math
from dataclasses import dataclass

from truths.pendulum import Rod


@dataclass(frozen=True)
class Liquid:
    """A Newtonian liquid.

    Attributes:
        viscosity: Dynamic viscosity [Pa s].
        density: [kg/m³].
        warming: Factor by which the viscosity falls until the end, at a constant rate of its
            logarithm; 1 for none.
    """

    viscosity: float
    density: float
    warming: float = 1.0

    def __post_init__(self) -> None:
        _check_positive("liquid", self, ("viscosity", "density", "warming"))

    def kinematic(self, elapsed: float) -> float:
        """Viscosity over density [m²/s] once the fraction `elapsed` of the time is over."""
        return self.viscosity / self.density * self.warming**-elapsed


@dataclass(frozen=True)
class StirScene:
    """A cup, and a stick that hangs into it from a pivot in the gripper.

    Attributes:
        cup_radius: [m].
        fill: Depth of the liquid [m].
        stick_radius, stick_length: [m].
        stick_density: Of the stick as it is written down [kg/m³].
        clearance: From the floor to the end of the stick that hangs straight down [m].
        pivot_damping: Torque of the pivot per angular velocity [N m s].
        dry_friction: Torque of the pivot that does not depend on the speed [N m].
        extra_mass: Fraction by which the stick is heavier than its density says.
        tilt: First inclination in the xz and the yz plane [rad].
    """

    cup_radius: float = 0.04
    fill: float = 0.05
    stick_radius: float = 0.0045
    stick_length: float = 0.22
    stick_density: float = 1200.0
    clearance: float = 0.015
    pivot_damping: float = 2e-5
    dry_friction: float = 0.0
    extra_mass: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        lengths = ("cup_radius", "fill", "stick_radius", "stick_length", "clearance")
        _check_positive("scene", self, (*lengths, "stick_density"))
        for name in ("pivot_damping", "dry_friction"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"scene: {name} must be 0 or more, got {getattr(self, name)}")
        if not -1.0 < self.extra_mass < math.inf:
            raise ValueError(f"scene: extra_mass must exceed -1, got {self.extra_mass}")
        if not self.clearance < self.fill < self.clearance + self.stick_length:
            raise ValueError(
                f"scene: the stick must dip in by a part of its length, got fill {self.fill} m, "
                f"clearance {self.clearance} m and stick_length {self.stick_length} m"
            )
        if self.stick_radius >= self.cup_radius:
            raise ValueError(
                f"scene: stick_radius {self.stick_radius} m must be below the cup's, "
                f"{self.cup_radius} m"
            )

    @property
    def rod(self) -> Rod:
        """The stick with its true mass."""
        radius, length = self.stick_radius, self.stick_length
        mass = self.stick_density * (1.0 + self.extra_mass) * math.pi * radius**2 * length
        return Rod(length, radius, mass)

    @property
    def submerged(self) -> float:
        """Length of the vertical stick in the liquid [m]."""
        return self.fill - self.clearance

    @property
    def pivot_height(self) -> float:
        """Above the floor [m]."""
        return self.clearance + self.stick_length


@dataclass(frozen=True)
class Resolution:
    """Of the grid, of time, and of the points that stand for surfaces.

    A cell of 1.5 mm and a step of 1 ms follow a stick of 9 mm at 10 cm/s; above 3 Pa s steps of
    0.4 ms are needed.

    Attributes:
        cell: Width of the grid's cells [m].
        step: Of time [s].
        drawn_in: Distance in cells by which points stand behind the surface, on the side that is
            not liquid. Smoothed points act as a thicker body; 0.45 is what makes up for it, for
            an oscillating as for a towed cylinder.
        sweeps: Corrections of the points' forces in each step.
        gain: Of each correction; points share the cells between them, so 1 corrects too little.
    """

    cell: float
    step: float
    drawn_in: float = 0.45
    sweeps: int = 2
    gain: float = 1.5

    def __post_init__(self) -> None:
        _check_positive("resolution", self, ("cell", "step", "gain"))
        if self.sweeps < 1:
            raise ValueError(f"resolution: sweeps must be 1 or more, got {self.sweeps}")

    def steps(self, seconds: float) -> int:
        """How many steps cover a time [s]."""
        return math.ceil(seconds / self.step - 1e-9)


def _check_positive(what: str, owner: object, names: tuple[str, ...]) -> None:
    for name in names:
        value = getattr(owner, name)
        if not 0.0 < value < math.inf:
            raise ValueError(f"{what}: {name} must be positive and finite, got {value}")
