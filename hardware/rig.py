"""rig.toml: the robot, the cameras and what stands in front of them, as a person writes it down.

Each number has a lower and an upper end, its unit, and why. The ends keep an arm from doing harm.
They are checked where a rig.toml is opened and before a session starts, by `CHECK_ENDS` as the
context of the validation; the rig of a recording, by which nothing moves any more, is read without
them. What numbers must be true together is in `rig_file`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import (
    BaseModel,
    GetCoreSchemaHandler,
    PrivateAttr,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import CoreSchema, core_schema

CHECK_ENDS = "check ends"
MAX_CYCLES = 100  # stars in a recording
MIN_CUP_RADIUS = 0.01  # [m]
MIN_LOOK = 0.05  # [m], from a camera to what it looks at
MIN_STICK_DENSITY = 300.0  # [kg/m3]; balsa and cork are lighter, and swim
MAX_STICK_DENSITY = 25_000.0  # [kg/m3]; no stick is denser
CONTROLLER_RATE = {"cb3": 125.0, "e-series": 500.0}  # Hz; others are rounded by the controller
View = Literal["xz", "yz"]


class RigSection(BaseModel, frozen=True, allow_inf_nan=False):
    """Part of a rig.toml; no change after reading."""

    def faults(self) -> Iterator[str]:
        """Contradictions between the section's own numbers."""
        yield from ()

    @model_validator(mode="after")
    def _agrees(self, info: ValidationInfo) -> Self:
        if info.context == CHECK_ENDS:
            for fault in self.faults():
                raise ValueError(fault)
        return self


@dataclass(frozen=True)
class Within:
    """Ends of a number, both allowed, its unit and the reason; annotates the number's field."""

    low: float
    high: float
    unit: str
    why: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.with_info_after_validator_function(self._checked, handler(source))

    def _checked(self, value: Any, info: ValidationInfo) -> Any:
        """The value; a text or None, where the field allows that, has no ends."""
        is_number = isinstance(value, int | float)
        if info.context == CHECK_ENDS and is_number and not self.low <= value <= self.high:
            unit = f" {self.unit}".rstrip()
            ends = f"{self.low:g} to {self.high:g}{unit}"
            raise ValueError(f"{value:g}{unit} is not within {ends}: {self.why}")
        return value


Coordinate = Annotated[float, Within(-3.0, 3.0, "m", "more looks like millimetres")]
Length = Annotated[float, Within(1e-4, 3.0, "m", "more looks like millimetres")]
Mass = Annotated[float, Within(1e-4, 30.0, "kg", "more looks like grams")]
Angle = Annotated[
    float,
    Within(-2 * np.pi, 2 * np.pi, "rad", "a joint turns once at the most; convert degrees to rad"),
]
Degrees = Annotated[float, Within(-360.0, 360.0, "deg", "more than a turn says nothing new")]
Speed = Annotated[
    float,
    Within(
        0.005, 0.25, "m/s", "a slower arm never arrives, a faster one is not safe beside a person"
    ),
]
Acceleration = Annotated[
    float,
    Within(
        0.02, 0.6, "m/s2", "a softer arm needs more way to stop than a box has, a harder one jerks"
    ),
]
Aside = Annotated[float, Within(-0.2, 0.2, "m", "a tool is held near the axis of the flange")]
Ahead = Annotated[
    float,
    Within(0.03, 0.6, "m", "a tool begins in front of the flange and ends within the arm's reach"),
]
MountedAhead = Annotated[float, Within(0.0, 0.4, "m", "what is mounted is in front of the flange")]
_LET_GO = "an arm works beside people, and may be let go so far at the most"
AcrossCup = Annotated[float, Within(-0.2, 0.2, "m", _LET_GO)]
AboveCup = Annotated[float, Within(0.05, 1.0, "m", _LET_GO)]
AroundCup = Annotated[float, Within(-1.0, 1.0, "m", _LET_GO)]
AboveTable = Annotated[float, Within(0.0, 1.0, "m", _LET_GO)]

Point = tuple[Coordinate, Coordinate, Coordinate]
Turn = tuple[Angle, Angle, Angle]
Tcp = tuple[Aside, Aside, Ahead, Angle, Angle, Angle]
Balance = tuple[Aside, Aside, MountedAhead]


class Robot(RigSection, frozen=True):
    """The arm and what is mounted on its flange.

    Attributes:
        host: Address of its controller.
        controller: Its generation.
        rate: Of the motion loop [Hz].
        payload: Of gripper and stick [kg].
        payload_centre: In the flange's frame [m].
        stirring_tcp: The stick's pivot in the flange's frame [m, rad].
        pouring_tcp: The source cup's lip in the flange's frame [m, rad].
        stirring_orientation: Rotation vector of the tool while it stirs, in the base frame [rad].
        pouring_orientation: The same before it pours, the source cup upright.
        start: Joint angles with the stick's pivot above the cup [rad]: which of the arm's
            configurations works; with them `rig_file` tells where the cup stands.
    """

    host: str
    controller: Literal["cb3", "e-series"] = "cb3"
    rate: Annotated[
        float, Within(50.0, 500.0, "Hz", "a slower loop jerks, and no controller is faster")
    ] = 125.0
    payload: Annotated[float, Within(0.1, 5.0, "kg", "so much weigh a gripper and what it holds")]
    payload_centre: Balance = (0.0, 0.0, 0.0)
    stirring_tcp: Tcp
    pouring_tcp: Tcp
    stirring_orientation: Turn
    pouring_orientation: Turn
    start: tuple[Angle, Angle, Angle, Angle, Angle, Angle]

    def faults(self) -> Iterator[str]:
        if (base := CONTROLLER_RATE[self.controller]) % self.rate:
            yield f"rate {self.rate:g} Hz does not divide the controller's {base:g} Hz; use 125"


class CupSettings(RigSection, frozen=True):
    """The cup that is stirred: where it stands in the base frame, and its sizes [m]."""

    position: Point
    yaw_deg: Degrees = 0.0
    radius: Annotated[
        float, Within(MIN_CUP_RADIUS, 0.2, "m", "a cup is as large as a hand can hold")
    ]
    height: Annotated[float, Within(0.01, 0.4, "m", "a cup is as high as a hand can hold")]
    fill: Length

    def faults(self) -> Iterator[str]:
        if self.fill >= self.height:
            yield f"fill {self.fill} m is not below height {self.height} m"


class StickSettings(RigSection, frozen=True):
    """The stick that hangs in the gripper; `colour` tells it from the background."""

    radius: Annotated[float, Within(0.001, 0.03, "m", "a stick is no wire and no post")]
    length: Annotated[float, Within(0.05, 0.6, "m", "a stick reaches into a cup")]
    mass: Mass
    colour: Literal["dark", "bright"] = "dark"

    @property
    def density(self) -> float:
        """Mean over its volume [kg/m3]."""
        return self.mass / (np.pi * self.radius**2 * self.length)

    def faults(self) -> Iterator[str]:
        mass = f"mass {self.mass:g} kg"
        if self.density > MAX_STICK_DENSITY:
            yield f"{mass} looks like grams; convert it to kg"
        if self.density < MIN_STICK_DENSITY:
            yield (
                f"{mass} is a density of {self.density:.3g} kg/m3, which no stick has (at least "
                f"{MIN_STICK_DENSITY:g}); weigh it in kg"
            )


class LiquidSettings(RigSection, frozen=True):
    """The liquid before it is stirred: its weighed density [kg/m3]."""

    density: Annotated[float, Within(50.0, 20_000.0, "kg/m3", "no liquid is as light or as heavy")]


MOTION_FIELDS = "pattern", "points", "radius", "speed", "acceleration", "height", "pause", "cycles"
"""Of [stirring] that a motion file may have; the others are of the place."""


class StirringSettings(RigSection, frozen=True):
    """The plan of a stir, in the cup's frame.

    Attributes:
        points: Vertices of the star, an odd number ("To Stir or Not to Stir": 9); 2 are of a line.
        radius: Of their circle [m].
        speed: Greatest along a stroke [m/s].
        acceleration: At its ends [m/s2].
        height: Of the pivot above the cup's floor [m].
        clear_height: Of the pivot where the stick is out of the cup [m].
        approach_speed: Down into the cup and out of it [m/s].
        rest: Time at rest before and after [s]; the cameras' noise is learned from it.
        pause: Time at rest at each vertex of a star [s].
        cycles: Stars in a recording.
    """

    pattern: Literal["star", "circle"] = "star"
    points: Annotated[
        int, Within(2, 99, "vertices", "fewer make no line, and no robot follows more")
    ] = 9
    radius: Annotated[
        float, Within(0.005, 0.15, "m", "a smaller star moves no liquid, a larger one fits no cup")
    ] = 0.025
    speed: Speed = 0.1
    acceleration: Acceleration = 0.5
    height: Length
    clear_height: Length
    approach_speed: Speed = 0.05
    rest: Annotated[
        float, Within(0.1, 60.0, "s", "the cameras' noise is learned from some pictures")
    ] = 2.0
    pause: Annotated[float, Within(0.0, 60.0, "s", "the liquid is at rest long before")] = 0.0
    cycles: Annotated[int, Within(1, MAX_CYCLES, "times", "so often a pattern is stirred")] = 1

    def faults(self) -> Iterator[str]:
        if self.pattern == "circle" and self.pause:
            yield f"pause {self.pause:g} s: a circle has no vertices to rest at; give 0"

    @classmethod
    def within[N: (int, float)](cls, name: str, value: N) -> N:
        """The number, or the nearest that its field may have."""
        (ends,) = (one for one in cls.model_fields[name].metadata if isinstance(one, Within))
        return type(value)(min(max(value, ends.low), ends.high))

    @field_validator("points")
    @classmethod
    def _is_odd(cls, points: int, info: ValidationInfo) -> int:
        if info.context == CHECK_ENDS and points % 2 == 0 and points != 2:
            raise ValueError(
                f"{points} is even: strokes would miss vertices; give an odd number, or 2 of a line"
            )
        return points


class Camera(RigSection, frozen=True):
    """A webcam: where it stands and looks, in the cup's frame.

    Attributes:
        view: The plane it sees.
        source: Number of the device, or path of a video or of a directory of frames.
        driver: File and class of another camera's driver, such as "my_camera.py:MyCamera", beside
            rig.toml; the class is called with this section, and is a `cameras.FrameSource`.
        width: Of the picture [px].
        height: Of the picture [px].
        rate: Pictures per second.
        position: Of its lens [m].
        target: A point in the middle of its picture [m].
        roll_deg: About its axis; `rig calibrate-cameras` measures it with a plumb line.
        intrinsics: File that `rig calibrate-cameras` wrote, beside rig.toml.
        focal_length: In pixels; used where there are no intrinsics.
        marker: Centre of the bright disc on the gripper's face that it sees, from the pivot [m].
        marker_radius: Of the disc [m].
    """

    view: View
    source: Annotated[int | str, Within(0, 9999, "", "devices are counted from 0")] = 0
    driver: str | None = None
    width: Annotated[int, Within(160, 4096, "px", "no webcam's picture is as wide")] = 640
    height: Annotated[int, Within(120, 4096, "px", "no webcam's picture is as high")] = 480
    rate: Annotated[float, Within(5.0, 240.0, "Hz", "no webcam is as slow or as fast")] = 30.0
    position: Point
    target: Point
    roll_deg: Annotated[
        float, Within(-45.0, 45.0, "deg", "a camera stands upright, or nearly so")
    ] = 0.0
    intrinsics: str | None = None
    focal_length: Annotated[
        float | None, Within(50.0, 20_000.0, "px", "no webcam sees as wide or as narrow")
    ] = None
    marker: Point
    marker_radius: Annotated[
        float, Within(0.001, 0.05, "m", "a disc on a gripper is seen, and fits on it")
    ] = 0.006

    @property
    def is_device(self) -> bool:
        """Whether it is a camera, and not a file of pictures; a driver is trusted to open one."""
        return isinstance(self.source, int) or self.source.startswith("/dev/") or bool(self.driver)

    def faults(self) -> Iterator[str]:
        if self.intrinsics is None and self.focal_length is None:
            yield "neither intrinsics nor focal_length is given"
        if np.linalg.norm(np.subtract(self.target, self.position)) < MIN_LOOK:
            yield f"position and target are less than {MIN_LOOK:g} m apart"


class PouringSettings(RigSection, frozen=True):
    """Place of a pour, in the base frame.

    Attributes:
        receiver: Centre of the receiver's floor [m].
        heading_deg: Horizontal direction from the lip to the receiver's axis, about z from x.
        approach_height: Above the pour's lip height, from which the lip comes down [m].
        approach_speed: Of the lip [m/s].
    """

    receiver: Point
    heading_deg: Degrees = 0.0
    approach_height: Annotated[
        float, Within(0.02, 0.5, "m", "the source must come from above the receiver's rim")
    ] = 0.1
    approach_speed: Speed = 0.05


class AxisLimits(RigSection, frozen=True):
    """A range for each axis [m], in the cup's frame."""

    x: tuple[Coordinate, Coordinate]
    y: tuple[Coordinate, Coordinate]
    z: tuple[Coordinate, Coordinate]

    @property
    def low(self) -> np.ndarray:
        """Lower corner, shape (3,)."""
        return np.array([self.x[0], self.y[0], self.z[0]])

    @property
    def high(self) -> np.ndarray:
        """Upper corner, shape (3,)."""
        return np.array([self.x[1], self.y[1], self.z[1]])

    def faults(self) -> Iterator[str]:
        for axis, (low, high) in {"x": self.x, "y": self.y, "z": self.z}.items():
            if not low < high:
                yield f"{axis} must ascend, got [{low}, {high}]"


class StirringBox(AxisLimits, frozen=True):
    """Within what is above a cup of a hand's size, with a stick of a forearm's length."""

    x: tuple[AcrossCup, AcrossCup]
    y: tuple[AcrossCup, AcrossCup]
    z: tuple[AboveCup, AboveCup]


class PouringBox(AxisLimits, frozen=True):
    """Within an arm's length about the cup, never below the table."""

    x: tuple[AroundCup, AroundCup]
    y: tuple[AroundCup, AroundCup]
    z: tuple[AboveTable, AboveTable]


class Limits(RigSection, frozen=True):
    """Limits of a commanded motion and of a running one; a person may set them lower.

    Attributes:
        stirring: Where the pivot may go.
        pouring: Where the source's lip may go.
        speed: Of the tool's centre [m/s].
        acceleration: Of it [m/s2].
        tilt_rate_deg_s: Of the tool.
        force: Change of the tool's force since rest [N].
        tracking_error: Between where the tool is and where it was told to be [m].
        latency: Between a command and its effect, which the box's margin allows for [s].
        silence: For which the controller may say nothing new [s].
        frame_age: Of a camera's latest picture [s].
        overrun: By which a tick of the motion loop may be late [s].
        reduced_mode: Whether the controller's reduced safety mode is good enough.
    """

    stirring: StirringBox
    pouring: PouringBox
    speed: Speed = 0.15
    acceleration: Acceleration = 0.5
    tilt_rate_deg_s: Annotated[
        float, Within(5.0, 180.0, "deg/s", "no pour is slower, and no wrist faster")
    ] = 180.0
    force: Annotated[
        float,
        Within(
            1.0,
            50.0,
            "N",
            "the arm's own noise is as large as 1 N; a face bears 65 N (ISO/TS 15066), and an arm "
            "pushes on while it stops",
        ),
    ] = 20.0
    tracking_error: Annotated[
        float, Within(0.001, 0.02, "m", "the arm follows within a few mm, or something holds it")
    ] = 0.01
    latency: Annotated[
        float, Within(0.008, 0.5, "s", "no controller acts within less than its own period")
    ] = 0.05
    silence: Annotated[
        float, Within(0.01, 0.05, "s", "a controller says something new every 8 ms")
    ] = 0.05
    frame_age: Annotated[
        float,
        Within(
            0.004, 0.15, "s", "no camera is faster, and an arm must not go on unseen for longer"
        ),
    ] = 0.15
    overrun: Annotated[
        float,
        Within(0.002, 0.05, "s", "no computer keeps time better than to a millisecond or two"),
    ] = 0.05
    reduced_mode: bool = False


class Rig(RigSection, frozen=True):
    """All of a rig.toml, perhaps with the motion of another file."""

    _motion_file: str = PrivateAttr("")

    robot: Robot
    cup: CupSettings
    stick: StickSettings
    liquid: LiquidSettings
    stirring: StirringSettings
    limits: Limits
    cameras: tuple[Camera, Camera]
    pouring: PouringSettings

    @model_validator(mode="after")
    def _has_both_views(self) -> "Rig":
        if (views := sorted(camera.view for camera in self.cameras)) != ["xz", "yz"]:
            raise ValueError(f"cameras: one must see xz and one yz, got {' and '.join(views)}")
        return self

    @property
    def motion_file(self) -> str:
        """Path of the file that the motion is from; empty where it is the rig's own."""
        return self._motion_file

    def stirred_by(self, path: str) -> Self:
        """The rig, whose motion is from a file."""
        named = self.model_copy()
        named._motion_file = path  # pyright: ignore[reportAttributeAccessIssue]  not a field
        return named

    def camera(self, view: View) -> Camera:
        """The camera of one view."""
        return next(camera for camera in self.cameras if camera.view == view)
