"""The cups of a pour, as a person writes them down in a cups.toml."""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    GetCoreSchemaHandler,
    ValidationError,
    model_validator,
)
from pydantic_core import CoreSchema, core_schema

from .numerics import MODEL_VERSION
from .pours.resolution import LEAST_VISCOSITY, Filled, settings

SLOWEST, FASTEST = 0.01, 30.0  # rad/s: a pour of three minutes; a cup that is flung
CONTACT_ANGLE_DEG = 60.0
"""Of a cup whose file has none: between those of water on glass and on plastics."""


@dataclass(frozen=True)
class Within:
    """Ends of a number, both allowed, and its unit; annotates the number's field."""

    low: float
    high: float
    unit: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self._checked, handler(source))

    def _checked(self, value: float) -> float:
        if not self.low <= value <= self.high:
            ends = f"{self.low:.3g} to {self.high:.5g} {self.unit}"
            raise ValueError(f"it must be {ends}, got {value:g}")
        return value


def _wets(angle: float) -> float:
    """A rule for contact angles [deg]: a small one other than 0 is in radians."""
    if 0.0 < angle <= np.pi:
        raise ValueError(f"it must be 0 or above {np.pi:.2f} deg, got {angle:g}; no radians")
    return angle


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Radius = Annotated[Number, Within(5e-3, 0.25, "m")]  # of cups that are poured by hand or arm
Height = Annotated[Number, Within(5e-3, 0.5, "m")]
Depth = Annotated[Number, Within(1e-3, 0.5, "m")]
LipHeight = Annotated[Number, Within(5e-3, 1.0, "m")]
Distance = Annotated[Number, Within(-0.5, 0.5, "m")]
Turn = Annotated[Number, Within(5.0, 180.0, "deg")]
ContactAngle = Annotated[Number, Within(0.0, 180.0, "deg"), AfterValidator(_wets)]
Rate = Annotated[Number, Within(float(np.degrees(SLOWEST)), float(np.degrees(FASTEST)), "deg/s")]
Hold = Annotated[Number, Within(0.0, 60.0, "s")]


class _Section(BaseModel, frozen=True, extra="forbid"):
    """Part of a file that a person writes: no unknown fields, no change after reading."""


class Source(_Section, frozen=True):
    """The cup that turns.

    Attributes:
        radius: Inside [m].
        height: Inside [m].
        fill: Depth of the liquid before the pour, up to the height [m].
        contact_angle_deg: Of the liquid's surface with wall and rim [deg]: below 90 it wets them.
    """

    radius: Radius
    height: Height
    fill: Depth
    contact_angle_deg: ContactAngle = CONTACT_ANGLE_DEG

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
    """The cup below.

    Attributes:
        radius: Inside [m].
        height: Inside, less than the lip height [m].
    """

    radius: Radius
    height: Height


class PourPlan(_Section, frozen=True):
    """Turn of the source, and range of the decision, in the units that people type.

    Attributes:
        lip_height: Of the source's lip above the receiver's floor [m]; the source turns about it.
        final_angle_deg: Angle at which the source stays; the liquid must reach the lip [deg].
        hold: Time at the final angle [s].
        angular_velocity_deg_s: Lowest and highest of the source [deg/s].
        distance: Shortest and longest from the lip to the receiver's axis, horizontally [m].
    """

    lip_height: LipHeight
    final_angle_deg: Turn
    hold: Hold
    angular_velocity_deg_s: tuple[Rate, Rate]
    distance: tuple[Distance, Distance]

    @property
    def final_angle(self) -> float:
        """Angle at which the source stays [rad]."""
        return float(np.radians(self.final_angle_deg))

    @model_validator(mode="after")
    def _turns_in_degrees(self) -> "PourPlan":
        fastest = self.angular_velocity_deg_s[1]
        if fastest <= 2.0 * np.pi:
            raise ValueError(
                f"angular_velocity_deg_s ends at {fastest:g} deg/s, a pour of half a minute; give "
                "deg/s, no rad/s"
            )
        return self

    @model_validator(mode="after")
    def _ranges_ascend(self) -> "PourPlan":
        for name in ("angular_velocity_deg_s", "distance"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} must ascend, got [{low}, {high}]")
        return self


class Cups(_Section, frozen=True):
    """Geometry of a pour, as a cups.toml file holds it."""

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
            raise ValueError(f"{path}: {_faults(err)}") from err

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


def _faults(err: ValidationError) -> str:
    """Fields, faults and values, in one line."""
    told = []
    for one in err.errors():
        field = ".".join(map(str, one["loc"])) or "cups"
        fault, value = one["msg"].removeprefix("Value error, "), one["input"]
        # of a missing field or a whole section the value says nothing
        own = one["type"] == "value_error" or isinstance(value, dict)
        told.append(f"{field}: {fault}" + ("" if own else f", got {value!r}"))
    return "; ".join(told)
