"""A stick that hangs in the gripper and dips into a liquid: two plane pendulums, driven."""

import math
from typing import NamedTuple

import numpy as np

from ..motion.poses import Numbers

GRAVITY = 9.81  # m/s2
AIR_DAMPING = 0.05  # 1/s; the amplitude in air falls to 1/e in 40 s
SUBSTEP = 0.002  # s
# Gauss-Legendre points of the wet part, for the drag's moment about the pivot
_POINTS, _WEIGHTS = (values.tolist() for values in np.polynomial.legendre.leggauss(6))


class Stick(NamedTuple):
    """A uniform round stick and the liquid it dips into.

    Attributes:
        radius: Of the stick [m].
        length: From the pivot, which is the TCP, to the tip [m].
        mass: [kg].
        liquid_density: [kg/m3].
        viscosity: Dynamic [Pa s].
        fill: Depth of the liquid [m].
        cup_position: Centre of the cup's floor in the base frame [m].
        drag: Factor on the drag of the published fit.
    """

    radius: float
    length: float
    mass: float
    liquid_density: float
    viscosity: float
    fill: float
    cup_position: tuple[float, float, float]
    drag: float = 1.0


def checked(stick: Stick) -> Stick:
    """The stick as it is.

    Raises:
        ValueError: A size is not positive and finite, or the cup has no place.
    """
    if len(stick.cup_position) != 3 or not np.isfinite(stick.cup_position).all():
        raise ValueError(f"cup_position must be three finite numbers, got {stick.cup_position}")
    for name, value in stick._asdict().items():
        if name != "cup_position" and not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"the stick's {name} must be positive and finite, got {value}")
    return stick


class Swing(NamedTuple):
    """Angle from the vertical [rad] and its rate [rad/s], in one plane."""

    angle: float
    rate: float


class Pivot(NamedTuple):
    """Motion of the pivot: one horizontal axis and the vertical one, and its height [m]."""

    speed: float
    lift: float
    acceleration: float
    lift_acceleration: float
    height: float


def step(stick: Stick, swing: Swing, pivot: Pivot, dt: float) -> Swing:
    """One substep of the pendulum in one plane.

    Moments about the pivot: weight and inertia of the stick; buoyancy, added mass (that of the
    displaced liquid, as of a long cylinder moved sideways) and drag of its wet part, each per
    unit length; weak damping in air. The drag coefficient is White's fit 1 + 10 Re^(-2/3)
    ("Viscous Fluid Flow"). The liquid is at rest. Drag acts implicitly on the new rate, which
    keeps the step stable in any viscosity.

    Args:
        stick: Sizes and liquid.
        swing: Before the step.
        pivot: Its motion during the step; `height` above the cup's floor.
        dt: [s].
    """
    sin, cos = math.sin(swing.angle), math.cos(swing.angle)
    dry = _dry_length(stick, pivot.height, cos)
    displaced = stick.liquid_density * math.pi * stick.radius**2  # kg/m, also the added mass
    wet_moment = 0.5 * (stick.length**2 - dry**2)
    first = 0.5 * stick.mass * stick.length
    inertia = stick.mass * stick.length**2 / 3.0
    inertia += displaced * (stick.length**3 - dry**3) / 3.0

    normal = pivot.acceleration * cos + pivot.lift_acceleration * sin
    moment = -(first - displaced * wet_moment) * GRAVITY * sin
    moment -= (first + displaced * wet_moment) * normal
    moment -= AIR_DAMPING * stick.mass * stick.length**2 / 3.0 * swing.rate
    push, hold = _drag(stick, swing, pivot.speed * cos + pivot.lift * sin, dry)
    rate = (inertia * swing.rate + dt * (moment - push)) / (inertia + dt * hold)
    return Swing(swing.angle + dt * rate, rate)


def _dry_length(stick: Stick, height: float, cos: float) -> float:
    """Length of the stick above the surface."""
    above = height - stick.fill
    if cos <= 0.0:
        return stick.length
    return min(max(above / cos, 0.0), stick.length)


def _drag(stick: Stick, swing: Swing, pivot_speed: float, dry: float) -> tuple[float, float]:
    """Moment of the drag at rate 0 [Nm], and its growth with the rate [Nms]."""
    half = 0.5 * (stick.length - dry)
    if half <= 0.0:
        return 0.0, 0.0
    diameter = 2.0 * stick.radius
    size = 0.5 * stick.drag * stick.liquid_density * diameter
    viscous = 10.0 * (stick.viscosity / (stick.liquid_density * diameter)) ** (2.0 / 3.0)
    push = hold = 0.0
    for point, weight in zip(_POINTS, _WEIGHTS, strict=True):
        arm = dry + half * (1.0 + point)
        speed = abs(pivot_speed + arm * swing.rate)
        # Cd |u| with Re written out, so that speed 0 divides nothing
        share = size * (speed + viscous * speed ** (1.0 / 3.0)) * weight * half * arm
        push += share * pivot_speed
        hold += share * arm
    return push, hold


class HangingStick:
    """Swings in the base frame's xz and yz planes, driven by the TCP."""

    def __init__(self, stick: Stick, pose: Numbers):
        self.stick = stick
        self.swings = (Swing(0.0, 0.0), Swing(0.0, 0.0))
        self._velocity = (0.0, 0.0, 0.0)
        self._height = float(pose[2])

    @property
    def angles(self) -> tuple[float, float]:
        """Inclination in xz and yz [rad], positive with the tip towards +x and +y."""
        return self.swings[0].angle, self.swings[1].angle

    def advance(self, pose: Numbers, velocity: Numbers, dt: float) -> None:
        """Swing for one tick, at whose end the TCP has this pose and velocity [m/s]."""
        new = tuple(float(value) for value in velocity[:3])
        old, self._velocity = self._velocity, new
        start, self._height = self._height, float(pose[2])
        count = max(1, round(dt / SUBSTEP))
        part = dt / count
        x, y = self.swings
        for k in range(count):
            share = (k + 0.5) / count
            vx, vy, vz = (a + share * (b - a) for a, b in zip(old, new, strict=True))
            ax, ay, az = ((b - a) / dt for a, b in zip(old, new, strict=True))
            height = start + share * (self._height - start) - self.stick.cup_position[2]
            x = step(self.stick, x, Pivot(vx, vz, ax, az, height), part)
            y = step(self.stick, y, Pivot(vy, vz, ay, az, height), part)
        self.swings = (x, y)
