"""The cups of a pour, as a person writes them down in a cups.toml."""

import tomllib
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    ValidationError,
    model_validator,
)

from .numerics import MODEL_VERSION
from .pours.resolution import LEAST_VISCOSITY, Filled, settings

MIN_SIZE, MAX_RADIUS, MAX_HEIGHT = 5e-3, 0.25, 0.5  # [m] of cups that are poured by hand or arm
MIN_FILL, MAX_LIP_HEIGHT = 1e-3, 1.0  # [m]
MAX_DISTANCE = 0.5  # [m] from the lip to the receiver's axis
SLOWEST, FASTEST = 0.01, 30.0  # rad/s: a pour of three minutes; a cup that is flung
CONTACT_ANGLE_DEG = 60.0
"""Of a cup whose file has none: between those of water on glass and on plastics."""


def _up_to(most: float) -> AfterValidator:
    """A rule for lengths [m], which guesses at the unit of those that break it."""

    def check(length: float) -> float:
        if abs(length) > most:
            unit = "millimetres" if abs(length) > 10.0 * most else "centimetres"
            raise ValueError(f"{length:g} m looks like {unit}; convert it to m")
        return length

    return AfterValidator(check)


def _pourable(rate: float) -> float:
    """A rule for angular velocities [deg/s], the same as that of `pour`."""
    if not SLOWEST <= np.radians(rate) <= FASTEST:
        slowest, fastest = np.degrees([SLOWEST, FASTEST])
        raise ValueError(f"it must be {slowest:.3g} to {fastest:.5g} deg/s")
    return rate


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Radius = Annotated[Number, Field(ge=MIN_SIZE), _up_to(MAX_RADIUS)]
Height = Annotated[Number, Field(ge=MIN_SIZE), _up_to(MAX_HEIGHT)]
Depth = Annotated[Number, Field(ge=MIN_FILL), _up_to(MAX_HEIGHT)]
LipHeight = Annotated[Number, Field(ge=MIN_SIZE), _up_to(MAX_LIP_HEIGHT)]
Distance = Annotated[Number, _up_to(MAX_DISTANCE)]
Degrees = Annotated[Number, Field(gt=0, le=180)]
ContactDegrees = Annotated[Number, Field(ge=0, le=180)]
DegreesPerSecond = Annotated[Number, AfterValidator(_pourable)]
Seconds = Annotated[Number, Field(ge=0, le=60)]


class _Section(BaseModel, frozen=True, extra="forbid"):
    """Part of a file that a person writes: no unknown fields, no change after reading."""


class Source(_Section, frozen=True):
    """The cup that turns [m]; `fill` is the liquid's depth before the pour.

    `contact_angle_deg` is that of the liquid's surface with wall and rim: below 90 it wets them.
    """

    radius: Radius
    height: Height
    fill: Depth
    contact_angle_deg: ContactDegrees = CONTACT_ANGLE_DEG

    @property
    def filled(self) -> Filled:
        """Its sizes, by which pours are cut into cells."""
        return Filled(self.radius, self.height, self.fill)

    @model_validator(mode="after")
    def _holds_its_fill(self) -> "Source":
        if self.fill > self.height:
            raise ValueError(f"fill {self.fill} m is more than the height {self.height} m")
        return self


class Receiver(_Section, frozen=True):
    """The cup below [m]."""

    radius: Radius
    height: Height


class PourPlan(_Section, frozen=True):
    """How the source turns, and the range of the decision, in the units that people type."""

    lip_height: LipHeight
    final_angle_deg: Degrees
    hold: Seconds
    angular_velocity_deg_s: tuple[DegreesPerSecond, DegreesPerSecond]
    distance: tuple[Distance, Distance]

    @property
    def final_angle(self) -> float:
        """Angle at which the source stays [rad]."""
        return float(np.radians(self.final_angle_deg))

    @model_validator(mode="after")
    def _ranges_ascend(self) -> "PourPlan":
        for name in ("angular_velocity_deg_s", "distance"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} must ascend, got [{low}, {high}]")
        return self


class Cups(_Section, frozen=True):
    """Geometry of a pour; `models` of a cups.toml file."""

    source: Source
    receiver: Receiver
    pour: PourPlan

    @model_validator(mode="after")
    def _receiver_below_lip(self) -> "Cups":
        if self.pour.lip_height <= self.receiver.height:
            raise ValueError(
                f"the lip ({self.pour.lip_height} m) is not above the receiver's rim "
                f"({self.receiver.height} m)"
            )
        return self

    @model_validator(mode="after")
    def _liquid_reaches_the_lip(self) -> "Cups":
        source, angle = self.source, self.pour.final_angle_deg
        least = float(np.degrees(np.arctan2(source.height - source.fill, source.radius)))
        if angle <= least:
            raise ValueError(
                f"pour.final_angle_deg = {angle:g}: nothing flows over the lip up to "
                f"{least:.0f} deg; turn the source further"
            )
        return self

    @classmethod
    def from_toml(cls, path: str | Path) -> "Cups":
        """Read a cups.toml.

        Raises:
            ValueError: naming file, field and value.
            FileNotFoundError: there is no such file.
        """
        try:
            return cls.model_validate(tomllib.loads(Path(path).read_text(encoding="utf-8-sig")))
        except tomllib.TOMLDecodeError as err:
            raise ValueError(f"{path}: not a TOML file: {err}") from err
        except UnicodeDecodeError as err:
            raise ValueError(f"{path}: not a text file") from err
        except ValidationError as err:
            raise ValueError(f"{path}: {_first_fault(err)}") from err

    @property
    def angular_velocity_range(self) -> tuple[float, float]:
        """Range of the decision [rad/s]."""
        low, high = np.radians(self.pour.angular_velocity_deg_s)
        return float(low), float(high)

    @property
    def distance_range(self) -> tuple[float, float]:
        """Range of the decision [m]."""
        return self.pour.distance

    @property
    def contact_angle(self) -> float:
        """Contact angle with the source's wall and rim [rad]; below π/2 the liquid wets them."""
        return float(np.radians(self.source.contact_angle_deg))

    @property
    def liquid_volume(self) -> float:
        """Liquid in the source before the pour [m³]."""
        return self.source.filled.volume

    def spacing(self, particles: int) -> float:
        """Particle spacing [m], the cube root of the liquid's volume per particle."""
        return (self.liquid_volume / particles) ** (1.0 / 3.0)

    def least_viscosity(self, density: float) -> float:
        """Viscosity [Pa s] below which pours look alike, of liquids of `density` [kg/m³]."""
        return LEAST_VISCOSITY * density

    def settings(self, particles: int = 0) -> dict[str, Any]:
        """Everything that fixes the simulator, as plain numbers, with the model's version."""
        return {
            "model": MODEL_VERSION,
            "scene": "pour",
            "particles": particles,
            "numerics": settings(self.source.filled, particles),
            **self.model_dump(),
        }


def _first_fault(err: ValidationError) -> str:
    """Field, fault and value of the first error, in one line."""
    first = err.errors()[0]
    field = ".".join(str(part) for part in first["loc"]) or "cups"
    fault = first["msg"].removeprefix("Value error, ")
    # of a missing field or a whole section the value says nothing
    value = first.get("input")
    return f"{field}: {fault}" + ("" if isinstance(value, dict) else f", got {value!r}")
