"""rig.toml: the robot, the cameras and what stands in front of them, as a person writes it down."""

from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, Field, model_validator

MAX_LENGTH = 3.0  # [m]; more looks like millimetres
CONTROLLER_RATE = {"cb3": 125.0, "e-series": 500.0}  # Hz; others are rounded by the controller
MAX_STICK_DENSITY = 25_000.0  # [kg/m3]; no stick is denser
MAX_MASS = 30.0  # [kg]; more looks like grams


def _in_metres(length: float) -> float:
    if abs(length) > MAX_LENGTH:
        raise ValueError(f"{length:g} m looks like millimetres; convert it to m")
    return length


def _in_kilograms(mass: float) -> float:
    if mass > MAX_MASS:
        raise ValueError(f"{mass:g} kg looks like grams; convert it to kg")
    return mass


def _odd(points: int) -> int:
    if points % 2 == 0:
        raise ValueError(f"{points} is even: all strokes would lie on one line; give an odd number")
    return points


Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Coordinate = Annotated[Number, AfterValidator(_in_metres)]
Length = Annotated[Positive, AfterValidator(_in_metres)]
Mass = Annotated[Positive, AfterValidator(_in_kilograms)]
Point = tuple[Coordinate, Coordinate, Coordinate]
Angle = Annotated[float, Field(ge=-2 * np.pi, le=2 * np.pi)]
Pose = tuple[Coordinate, Coordinate, Coordinate, Angle, Angle, Angle]
Degrees = Annotated[float, Field(ge=-360, le=360)]
View = Literal["xz", "yz"]


class Section(BaseModel, frozen=True, extra="forbid"):
    """Part of a file that a person writes: no unknown fields, no change after reading."""


class Robot(Section, frozen=True):
    """The arm and what is mounted on its flange.

    Attributes:
        driver: Which driver moves it.
        host: Address of its controller.
        controller: Its generation; the emulator follows it.
        rate: Of the motion loop [Hz].
        payload: Of gripper and stick [kg].
        payload_centre: In the flange's frame [m].
        stirring_tcp: The stick's pivot in the flange's frame [m, rad].
        pouring_tcp: The source cup's lip in the flange's frame [m, rad].
        stirring_orientation: Rotation vector of the tool while it stirs, in the base frame [rad].
        pouring_orientation: The same before it pours, the source cup upright.
        start: Joint angles near which the arm works [rad]: which of the arm's configurations.
    """

    driver: Literal["ur"] = "ur"
    host: str
    controller: Literal["cb3", "e-series"] = "cb3"
    rate: Annotated[float, Field(ge=50, le=500)] = 125.0
    payload: Mass
    payload_centre: Point = (0.0, 0.0, 0.0)
    stirring_tcp: Pose
    pouring_tcp: Pose
    stirring_orientation: tuple[Angle, Angle, Angle]
    pouring_orientation: tuple[Angle, Angle, Angle]
    start: tuple[Angle, Angle, Angle, Angle, Angle, Angle]

    @model_validator(mode="after")
    def _divides_the_clock(self) -> "Robot":
        base = CONTROLLER_RATE[self.controller]
        if base % self.rate:
            raise ValueError(
                f"rate {self.rate:g} Hz does not divide the controller's {base:g} Hz; use 125"
            )
        return self


class Cup(Section, frozen=True):
    """The cup that is stirred: where it stands in the base frame, and its sizes [m]."""

    position: Point
    yaw_deg: Degrees = 0.0
    radius: Length
    height: Length
    fill: Length

    @model_validator(mode="after")
    def _holds_its_fill(self) -> "Cup":
        if self.fill >= self.height:
            raise ValueError(f"fill {self.fill} m is not below height {self.height} m")
        return self


class Stick(Section, frozen=True):
    """The stick that hangs in the gripper; `colour` tells it from the background."""

    radius: Length
    length: Length
    mass: Mass
    colour: Literal["dark", "bright"] = "dark"

    @model_validator(mode="after")
    def _weighs_as_a_stick(self) -> "Stick":
        if self.density > MAX_STICK_DENSITY:
            raise ValueError(f"mass {self.mass:g} kg looks like grams; convert it to kg")
        return self

    @property
    def density(self) -> float:
        """Mean over its volume [kg/m3]."""
        return self.mass / (np.pi * self.radius**2 * self.length)


class Liquid(Section, frozen=True):
    """What is known of the liquid before it is stirred: its weighed density [kg/m3]."""

    density: Annotated[float, Field(ge=50, le=20_000)]


class Stirring(Section, frozen=True):
    """The plan of a stir, in the cup's frame.

    Attributes:
        points: Vertices of the star, an odd number ("To Stir or Not to Stir": 9).
        radius: Of their circle [m].
        speed: Greatest along a stroke [m/s].
        acceleration: At its ends [m/s2].
        height: Of the pivot above the cup's floor [m].
        clear_height: Of the pivot where the stick is out of the cup [m].
        approach_speed: Down into the cup and out of it [m/s].
        rest: Time at rest before and after [s]; the cameras' noise is learned from it.
        cycles: Stars in a recording.
    """

    pattern: Literal["star", "circle"] = "star"
    points: Annotated[int, Field(ge=5), AfterValidator(_odd)] = 9
    radius: Length = 0.025
    speed: Positive = 0.1
    acceleration: Positive = 0.5
    height: Length
    clear_height: Length
    approach_speed: Positive = 0.05
    rest: Positive = 2.0
    cycles: Annotated[int, Field(ge=1, le=100)] = 1


class Box(Section, frozen=True):
    """A range for each axis [m], in the cup's frame."""

    x: tuple[Coordinate, Coordinate]
    y: tuple[Coordinate, Coordinate]
    z: tuple[Coordinate, Coordinate]

    @model_validator(mode="after")
    def _ascend(self) -> "Box":
        for name in ("x", "y", "z"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} must ascend, got [{low}, {high}]")
        return self

    @property
    def low(self) -> np.ndarray:
        """Lower corner, shape (3,)."""
        return np.array([self.x[0], self.y[0], self.z[0]])

    @property
    def high(self) -> np.ndarray:
        """Upper corner, shape (3,)."""
        return np.array([self.x[1], self.y[1], self.z[1]])


class Limits(Section, frozen=True):
    """What a commanded motion and a running one must keep.

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

    stirring: Box
    pouring: Box
    speed: Annotated[float, Field(gt=0, le=0.25)] = 0.15
    acceleration: Annotated[float, Field(gt=0, le=0.6)] = 0.5
    tilt_rate_deg_s: Annotated[float, Field(gt=0, le=180)] = 180.0
    force: Annotated[float, Field(gt=0, le=100)] = 20.0
    tracking_error: Length = 0.01
    latency: Annotated[float, Field(ge=0, le=0.5)] = 0.05
    silence: Annotated[float, Field(gt=0, le=0.05)] = 0.05
    frame_age: Annotated[float, Field(gt=0, le=0.15)] = 0.15
    overrun: Annotated[float, Field(gt=0, le=0.05)] = 0.05
    reduced_mode: bool = False


class Camera(Section, frozen=True):
    """A webcam: where it stands and looks, in the cup's frame.

    Attributes:
        view: The plane it sees.
        source: Number of the device, or path of a video or of a directory of frames.
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
    source: int | str = 0
    width: Annotated[int, Field(ge=160, le=4096)] = 640
    height: Annotated[int, Field(ge=120, le=4096)] = 480
    rate: Annotated[float, Field(ge=5, le=240)] = 30.0
    position: Point
    target: Point
    roll_deg: Annotated[float, Field(ge=-45, le=45)] = 0.0
    intrinsics: str | None = None
    focal_length: Positive | None = None
    marker: Point
    marker_radius: Length = 0.006

    @property
    def is_device(self) -> bool:
        """Whether it is a camera, and not a file of pictures."""
        return isinstance(self.source, int) or self.source.startswith("/dev/")

    @model_validator(mode="after")
    def _knows_its_lens(self) -> "Camera":
        if self.intrinsics is None and self.focal_length is None:
            raise ValueError("neither intrinsics nor focal_length is given")
        return self


class Pouring(Section, frozen=True):
    """Where a pour happens, in the base frame.

    Attributes:
        receiver: Centre of the receiver's floor [m].
        heading_deg: Horizontal direction from the lip to the receiver's axis, about z from x.
        approach_height: Above the pour's lip height, from which the lip comes down [m].
        approach_speed: Of the lip [m/s].
    """

    receiver: Point
    heading_deg: Degrees = 0.0
    approach_height: Length = 0.1
    approach_speed: Positive = 0.05


class Rig(Section, frozen=True):
    """All of a rig.toml."""

    robot: Robot
    cup: Cup
    stick: Stick
    liquid: Liquid
    stirring: Stirring
    limits: Limits
    cameras: tuple[Camera, Camera]
    pouring: Pouring

    @model_validator(mode="after")
    def _fits_together(self) -> "Rig":
        views = sorted(camera.view for camera in self.cameras)
        if views != ["xz", "yz"]:
            raise ValueError(f"cameras: one must see xz and one yz, got {' and '.join(views)}")
        if self.stirring.speed > self.limits.speed:
            raise ValueError(
                f"stirring.speed {self.stirring.speed} m/s is above limits.speed "
                f"{self.limits.speed} m/s"
            )
        tip = self.stirring.height - self.stick.length
        if not 0.0 < tip < self.cup.fill:
            raise ValueError(
                f"stirring.height: the stick's tip is {tip:.3f} m above the floor, "
                f"outside the liquid (cup.fill = {self.cup.fill} m)"
            )
        if self.stirring.radius + self.stick.radius >= self.cup.radius:
            raise ValueError(
                f"stirring.radius {self.stirring.radius} m brings the stick to the cup's wall "
                f"(cup.radius = {self.cup.radius} m)"
            )
        if self.limits.stirring.z[0] <= self.stick.length:
            raise ValueError(
                f"limits.stirring.z {self.limits.stirring.z[0]} m lets the stick's tip reach the "
                f"cup's floor (stick.length = {self.stick.length} m)"
            )
        if self.stirring.clear_height - self.stick.length <= self.cup.height:
            raise ValueError(
                f"stirring.clear_height {self.stirring.clear_height} m leaves the stick in the cup"
            )
        return self

    def camera(self, view: View) -> Camera:
        """The camera of one view."""
        return next(camera for camera in self.cameras if camera.view == view)
