"""Setup of a stirring simulation besides liquid, path and seed: cup, stick, discretisation."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from .apic.gravity import GRAVITY
from .number_checks import check_numbers
from .numerics import LEAST_VISCOSITY, MODEL_VERSION, Numerics, check_resolution
from .rig import Rig
from .trajectory import PivotPath, resting, top_speed

MAX_FILL_RATIO = 1.5  # times the setup's fill is the largest
MAX_TILT = 1.5  # rad
FIRST_SECONDS, FIRST_SAMPLES = 0.15, 5  # of a recording, which show how the stick starts
LEAST_TORQUE = 1e-12  # N m: nothing, to divide by


class HasRig(Protocol):
    """The part of a recording that a setup reads."""

    @property
    def attrs(self) -> Mapping[str, Any]: ...
    @property
    def gripper(self) -> PivotPath: ...


@dataclass(frozen=True)
class Cup:
    """An upright cylinder on z = 0 [m]; `fill` is the liquid's depth with the stick in it."""

    radius: float
    height: float
    fill: float

    def __post_init__(self) -> None:
        check_numbers("cup", radius=self.radius, height=self.height, fill=self.fill)
        if self.fill > self.height:
            raise ValueError(f"cup: fill {self.fill} m is more than its height {self.height} m")


@dataclass(frozen=True)
class Stick:
    """A uniform cylinder that pivots freely at its upper end [m, kg]."""

    radius: float
    length: float
    mass: float

    def __post_init__(self) -> None:
        check_numbers("stick", radius=self.radius, length=self.length, mass=self.mass)

    @property
    def gyration(self) -> float:
        """Moment of inertia about the pivot, by mass [m²]."""
        return self.length**2 / 3.0 + self.radius**2 / 4.0

    @property
    def inertia(self) -> float:
        """Moment of inertia about the pivot [kg m²]."""
        return self.mass * self.gyration


@dataclass(frozen=True)
class StirSetup:
    """All that fixes a stirring simulation besides liquid, path and seed.

    Attributes:
        cup: The cup.
        stick: The stick.
        submerged: Depth of the stick's tip below the surface at rest [m].
        particles: Number of particles, which decides the cells; 0: as many as the cells make that
            `numerics` chooses for the stick.
        numerics: Constants of the discretisation.
        tilt: Of the stick at the start, as the cameras see it, in the xz and yz planes [rad]; what
            effects in the cameras add is no lean of the stick.
        rest: Its mean until the gripper moves, seen likewise; None: the same.
    """

    cup: Cup
    stick: Stick
    submerged: float
    particles: int = 0
    numerics: Numerics = field(default_factory=Numerics)
    tilt: tuple[float, float] = (0.0, 0.0)
    rest: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        check_numbers("setup", submerged=self.submerged)
        check_numbers("setup", zero=True, particles=self.particles)
        for fault in self._faults():
            raise ValueError(f"setup: {fault}")
        if self.particles == 0:
            object.__setattr__(self, "particles", self._usual_particles())

    def _faults(self) -> Iterator[str]:
        if self.particles != int(self.particles):
            yield f"particles must be a whole number, got {self.particles}"
        for name, lean in (("tilt", self.tilt), ("rest", self.rest or self.tilt)):
            if len(lean) != 2 or not all(abs(angle) < MAX_TILT for angle in lean):
                yield f"{name} must be two angles of less than {MAX_TILT} rad, got {lean}"
        if self.submerged > self.stick.length:
            yield (
                "submerged must be at most the stick's length, or its pivot is in the liquid: "
                f"{self.stick.length:g} m, got {self.submerged:g}; raise the gripper"
            )
        if self.stick.radius >= self.cup.radius:
            yield (
                f"the stick, of radius {self.stick.radius} m, does not fit into the cup, of "
                f"radius {self.cup.radius} m"
            )

    @classmethod
    def from_recording(
        cls, recording: HasRig, particles: int = 0, numerics: Numerics | None = None
    ) -> "StirSetup":
        """The setup that a recording's attributes describe (the first pivot position too).

        The stick starts as inclined as the cameras saw it at first; without `inclination` it hangs
        straight down.

        Raises:
            ValueError: an attribute is missing or makes no sense, or the stick does not reach the
                liquid.
        Warns:
            UntestedResolution: `particles` make cells that no reference was compared with.
        """
        attrs = recording.attrs
        wanted = ("cup_radius", "cup_height", "fill", "stick_radius", "stick_length")
        missing = [name for name in wanted if name not in attrs]
        if "stick_mass" not in attrs and "stick_density" not in attrs:
            missing.append("stick_mass or stick_density")
        if missing:
            raise ValueError(f"the recording lacks the attributes {', '.join(missing)}; add them")
        cup_radius, height, fill, radius, length = (float(attrs[name]) for name in wanted)
        if "stick_mass" in attrs:
            mass = float(attrs["stick_mass"])
        else:
            mass = float(attrs["stick_density"]) * np.pi * radius**2 * length
        position = np.asarray(recording.gripper.position)
        start = position[np.isfinite(position).all(axis=1)][0]
        submerged = fill - (float(start[2]) - length)
        if not 0.0 < submerged:
            raise ValueError(
                f"the stick's tip starts {-submerged:.4f} m above the liquid; check fill={fill}, "
                f"stick_length={length} and the gripper's z={start[2]:.4f}"
            )
        setup = cls(
            cup=Cup(cup_radius, height, fill),
            stick=Stick(radius, length, mass),
            submerged=min(submerged, fill),
            particles=particles,
            numerics=numerics or Numerics(),
            **_leans(recording),
        )
        check_resolution(radius, setup.cell)
        return setup

    @property
    def per_cell(self) -> int:
        """Particles in a full cell."""
        return self.numerics.per_cell

    @property
    def cell(self) -> float:
        """Edge of a cell [m]."""
        volume = self.per_cell * self.liquid_volume(self.cup.fill)
        return float((volume / self.particles) ** (1.0 / 3.0))

    @property
    def spacing(self) -> float:
        """Particle spacing [m], the cube root of the liquid's volume per particle."""
        return self.cell / self.per_cell ** (1.0 / 3.0)

    def step(self, gripper: PivotPath) -> float:
        """Step of time [s] for a path of the gripper."""
        longest = self.numerics.step(self.cell, 0.0)
        return self.numerics.step(self.cell, top_speed(gripper, longest))

    @property
    def deepest(self) -> float:
        """Largest depth of liquid for which there is room [m]."""
        return max(min(self.cup.height, MAX_FILL_RATIO * self.cup.fill), self.cup.fill)

    def least_viscosity(self, density: float) -> float:
        """Viscosity [Pa s] below which stirs look alike, of liquids of `density` [kg/m³]."""
        return LEAST_VISCOSITY * density

    def _usual_particles(self) -> int:
        cell = self.numerics.cell_for(self.stick.radius)
        return max(round(self.per_cell * self.liquid_volume(self.cup.fill) / cell**3), 1)

    def liquid_volume(self, fill: float | np.ndarray) -> Any:
        """Liquid [m³] whose surface is at the depth `fill` [m] around the stick."""
        wet = np.clip(self.submerged + (fill - self.cup.fill), 0.0, fill)
        return np.pi * (self.cup.radius**2 * fill - self.stick.radius**2 * wet)

    def count(self, fill: float | np.ndarray) -> np.ndarray:
        """Particles of the setup's size that fill the cup to the depth `fill` [m]."""
        return np.rint(self.liquid_volume(fill) / self.spacing**3).astype(int)

    def settings(self) -> dict[str, Any]:
        """Everything that fixes the simulator, as plain numbers, with the model's version."""
        return {"model": MODEL_VERSION, "scene": "stir", **asdict(self)}


def hanging(tilt: np.ndarray) -> np.ndarray:
    """Unit vectors [..., 3] from the pivot to the tip of sticks that lean by `tilt` [..., 2] in the
    xz and yz planes [rad]."""
    down = np.concatenate([np.tan(tilt), -np.ones_like(tilt[..., :1])], axis=-1)
    return down / np.linalg.norm(down, axis=-1, keepdims=True)


def start_tilt(setup: StirSetup, rig: Rig, density: ArrayLike, offset: np.ndarray) -> np.ndarray:
    """Inclination at which each stick starts [rad], shape [B, 2].

    A stick that nothing rubs leaves its first inclination at once, so its first samples alone show
    where it starts. One that dry friction holds stays there until the gripper moves, so all of the
    rest does. Between the two, the share of the weight's torque that friction bears decides.

    Args:
        setup: Whose cameras saw it.
        rig: Stick, friction, fill and path of B stirs.
        density: Of the liquids [kg/m³], shape [B].
        offset: What the cameras add to the inclination of a hanging stick [rad], shape [B, 2].
    """
    first = np.array(setup.tilt) - offset
    rest = first if setup.rest is None else np.array(setup.rest) - offset
    needed = _weight_torque(setup.stick, rig, np.asarray(density), rest)
    borne = rig.pivot_friction / np.maximum(np.maximum(needed, rig.pivot_friction), LEAST_TORQUE)
    return first + borne[:, None] * (rest - first)


def _weight_torque(stick: Stick, rig: Rig, density: np.ndarray, tilt: np.ndarray) -> np.ndarray:
    """Torque of weight and lift on sticks that lean by `tilt` [B, 2] at the start [N m]."""
    down = hanging(tilt)
    above = (rig.path[:, 0, 2] - rig.fill) / np.maximum(-down[:, 2], 0.2)
    dry = np.clip(above, 0.0, stick.length)
    lift = density * np.pi * stick.radius**2 * (stick.length**2 - dry**2)
    return 0.5 * GRAVITY * np.abs(rig.stick_mass * stick.length - lift) * np.hypot(*down[:, :2].T)


def _leans(recording: HasRig) -> dict[str, tuple[float, float]]:
    """Mean inclination of the first samples, and until the gripper moves [rad]; without both
    planes in the first, none."""
    seen = getattr(recording, "inclination", None)
    if seen is None:
        return {}
    time = np.asarray(recording.gripper.time)
    first = max(FIRST_SAMPLES, int(np.sum(time - time[0] < FIRST_SECONDS)))
    last = max(first, resting(recording.gripper))
    seen = np.asarray(seen, float)
    if not np.isfinite(seen[:first]).any(axis=0).all():
        return {}
    means = (tuple(np.nanmean(seen[:count], axis=0).tolist()) for count in (first, last))
    return dict(zip(("tilt", "rest"), means, strict=True))
