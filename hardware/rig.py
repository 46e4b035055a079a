"""rig.toml: the robot, the cameras and what stands in front of them, as a person writes it down."""

from typing import Annotated, Literal

import numpy as np
from pydantic import ValidationInfo, model_validator

from .rig_limits import AxisLimits as AxisLimits
from .rig_limits import Limits
from .rig_numbers import (
    Acceleration,
    Angle,
    Balance,
    Degrees,
    Length,
    Mass,
    Number,
    Point,
    RigSection,
    Speed,
    Tcp,
    Turn,
    contradiction,
    is_recorded,
    unless_recorded,
    within,
)

CONTROLLER_RATE = {"cb3": 125.0, "e-series": 500.0}  # Hz; others are rounded by the controller
MIN_STICK_DENSITY = 300.0  # [kg/m3]; balsa and cork are lighter, and swim
MAX_STICK_DENSITY = 25_000.0  # [kg/m3]; no stick is denser
MAX_CYCLES = 100  # stars in a recording
MIN_LOOK = 0.05  # [m], from a camera to what it looks at
MIN_CUP_RADIUS = 0.01  # [m]


def checked_cycles(count: int) -> int:
    """How often a pattern is stirred.

    Raises:
        ValueError: It is below 1 or above `MAX_CYCLES`.
    """
    if not 1 <= count <= MAX_CYCLES:
        raise ValueError(f"{count} is not from 1 to {MAX_CYCLES}: so often a pattern is stirred")
    return count


def _device(number: int) -> int:
    if number < 0:
        raise ValueError(f"{number} is no number of a device; they count from 0")
    return number


def _odd(points: int) -> int:
    if points % 2 == 0:
        raise ValueError(f"{points} is even: all strokes would lie on one line; give an odd number")
    return points


View = Literal["xz", "yz"]


class Robot(RigSection, frozen=True):
    """The arm and what is mounted on its flange.

    Attributes:
        driver: Which driver moves it.
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
            configurations works; with them `rig_geometry` checks where the cup stands.
    """

    driver: Literal["ur"] = "ur"
    host: str
    controller: Literal["cb3", "e-series"] = "cb3"
    rate: Annotated[
        Number, within(50.0, 500.0, "Hz", "a slower loop jerks, and no controller is faster")
    ] = 125.0
    payload: Annotated[Mass, within(0.1, 5.0, "kg", "so much weigh a gripper and what it holds")]
    payload_centre: Balance = (0.0, 0.0, 0.0)
    stirring_tcp: Tcp
    pouring_tcp: Tcp
    stirring_orientation: Turn
    pouring_orientation: Turn
    start: tuple[Angle, Angle, Angle, Angle, Angle, Angle]

    @contradiction
    def _divides_the_clock(self) -> None:
        base = CONTROLLER_RATE[self.controller]
        if base % self.rate:
            raise ValueError(
                f"rate {self.rate:g} Hz does not divide the controller's {base:g} Hz; use 125"
            )


class CupSettings(RigSection, frozen=True):
    """The cup that is stirred: where it stands in the base frame, and its sizes [m]."""

    position: Point
    yaw_deg: Degrees = 0.0
    radius: Annotated[
        Length, within(MIN_CUP_RADIUS, 0.2, "m", "a cup is as large as a hand can hold")
    ]
    height: Annotated[Length, within(0.01, 0.4, "m", "a cup is as high as a hand can hold")]
    fill: Length

    @contradiction
    def _holds_its_fill(self) -> None:
        if self.fill >= self.height:
            raise ValueError(f"fill {self.fill} m is not below height {self.height} m")


class StickSettings(RigSection, frozen=True):
    """The stick that hangs in the gripper; `colour` tells it from the background."""

    radius: Annotated[Length, within(0.001, 0.03, "m", "a stick is no wire and no post")]
    length: Annotated[Length, within(0.05, 0.6, "m", "a stick reaches into a cup")]
    mass: Mass
    colour: Literal["dark", "bright"] = "dark"

    @contradiction
    def _weighs_as_a_stick(self) -> None:
        if self.density > MAX_STICK_DENSITY:
            raise ValueError(f"mass {self.mass:g} kg looks like grams; convert it to kg")
        if self.density < MIN_STICK_DENSITY:
            raise ValueError(
                f"mass {self.mass:g} kg is a density of {self.density:.3g} kg/m3, which no stick "
                f"has (at least {MIN_STICK_DENSITY:g}); weigh it in kg"
            )

    @property
    def density(self) -> float:
        """Mean over its volume [kg/m3]."""
        return self.mass / (np.pi * self.radius**2 * self.length)


class LiquidSettings(RigSection, frozen=True):
    """What is known of the liquid before it is stirred: its weighed density [kg/m3]."""

    density: Annotated[Number, within(50.0, 20_000.0, "kg/m3", "no liquid is as light or as heavy")]


class StirringSettings(RigSection, frozen=True):
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
    points: Annotated[
        int, within(5, 99, "vertices", "fewer make no star"), unless_recorded(_odd)
    ] = 9
    radius: Annotated[
        Length, within(0.005, 0.15, "m", "a smaller star moves no liquid, a larger one fits no cup")
    ] = 0.025
    speed: Speed = 0.1
    acceleration: Acceleration = 0.5
    height: Length
    clear_height: Length
    approach_speed: Speed = 0.05
    rest: Annotated[
        Number, within(0.1, 60.0, "s", "the cameras' noise is learned from some pictures")
    ] = 2.0
    cycles: Annotated[int, unless_recorded(checked_cycles)] = 1


class Camera(RigSection, frozen=True):
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
    source: Annotated[int, unless_recorded(_device)] | str = 0
    width: Annotated[int, within(160, 4096, "px", "no webcam's picture is as wide")] = 640
    height: Annotated[int, within(120, 4096, "px", "no webcam's picture is as high")] = 480
    rate: Annotated[Number, within(5.0, 240.0, "Hz", "no webcam is as slow or as fast")] = 30.0
    position: Point
    target: Point
    roll_deg: Annotated[
        Number, within(-45.0, 45.0, "deg", "a camera stands upright, or nearly so")
    ] = 0.0
    intrinsics: str | None = None
    focal_length: (
        Annotated[Number, within(50.0, 20_000.0, "px", "no webcam sees as wide or as narrow")]
        | None
    ) = None
    marker: Point
    marker_radius: Annotated[
        Length, within(0.001, 0.05, "m", "a disc on a gripper is seen, and fits on it")
    ] = 0.006

    @property
    def is_device(self) -> bool:
        """Whether it is a camera, and not a file of pictures."""
        return isinstance(self.source, int) or self.source.startswith("/dev/")

    @contradiction
    def _knows_its_lens(self) -> None:
        if self.intrinsics is None and self.focal_length is None:
            raise ValueError("neither intrinsics nor focal_length is given")

    @contradiction
    def _looks_somewhere(self) -> None:
        if np.linalg.norm(np.subtract(self.target, self.position)) < MIN_LOOK:
            raise ValueError(f"position and target are less than {MIN_LOOK:g} m apart")


class PouringSettings(RigSection, frozen=True):
    """Where a pour happens, in the base frame.

    Attributes:
        receiver: Centre of the receiver's floor [m].
        heading_deg: Horizontal direction from the lip to the receiver's axis, about z from x.
        approach_height: Above the pour's lip height, from which the lip comes down [m].
        approach_speed: Of the lip [m/s].
    """

    receiver: Point
    heading_deg: Degrees = 0.0
    approach_height: Annotated[
        Length, within(0.02, 0.5, "m", "the source must come from above the receiver's rim")
    ] = 0.1
    approach_speed: Speed = 0.05


class Rig(RigSection, frozen=True):
    """All of a rig.toml."""

    robot: Robot
    cup: CupSettings
    stick: StickSettings
    liquid: LiquidSettings
    stirring: StirringSettings
    limits: Limits
    cameras: tuple[Camera, Camera]
    pouring: PouringSettings

    @model_validator(mode="after")
    def _fits_together(self, info: ValidationInfo) -> "Rig":
        _check_views(self.cameras)
        if not is_recorded(info):
            _check_sources(self.cameras)
            _check_frame_age(self)
            _check_speeds(self)
            _check_stick(self)
            _check_heights(self)
            check_receiver(self, MIN_CUP_RADIUS)
        return self

    def camera(self, view: View) -> Camera:
        """The camera of one view."""
        return next(camera for camera in self.cameras if camera.view == view)


def check_receiver(rig: Rig, radius: float) -> None:
    """Refuse a receiver that stands in the stirred cup.

    Args:
        rig: Says where both stand.
        radius: Of the receiver [m], which is not the rig's but that of the cups that are poured
            with.

    Raises:
        ValueError: They overlap.
    """
    apart = float(np.hypot(*np.subtract(rig.pouring.receiver[:2], rig.cup.position[:2])))
    if apart <= rig.cup.radius + radius:
        raise ValueError(
            f"pouring.receiver is {apart:.3f} m from cup.position: it stands in the stirred cup "
            f"(cup.radius = {rig.cup.radius} m, the receiver's is at least {radius:g} m)"
        )


def _check_views(cameras: tuple[Camera, Camera]) -> None:
    views = sorted(camera.view for camera in cameras)
    if views != ["xz", "yz"]:
        raise ValueError(f"cameras: one must see xz and one yz, got {' and '.join(views)}")


def _check_sources(cameras: tuple[Camera, Camera]) -> None:
    first, second = (camera.source for camera in cameras)
    if first == second and cameras[0].is_device:
        raise ValueError(f"cameras: both have the source {first!r}; each needs its own")


def _check_frame_age(rig: Rig) -> None:
    slowest, limits = min(camera.rate for camera in rig.cameras), rig.limits
    if limits.frame_age < 1.0 / slowest:
        raise ValueError(
            f"limits.frame_age {limits.frame_age} s is below the {1.0 / slowest:.3g} s from one "
            "picture of a camera to the next"
        )


def _check_speeds(rig: Rig) -> None:
    stirring, limits = rig.stirring, rig.limits
    speeds = (
        ("stirring.speed", stirring.speed),
        ("stirring.approach_speed", stirring.approach_speed),
        ("pouring.approach_speed", rig.pouring.approach_speed),
    )
    for name, speed in speeds:
        if speed > limits.speed:
            raise ValueError(f"{name} {speed} m/s is above limits.speed {limits.speed} m/s")
    if stirring.acceleration > limits.acceleration:
        raise ValueError(
            f"stirring.acceleration {stirring.acceleration} m/s2 is above limits.acceleration "
            f"{limits.acceleration} m/s2"
        )


def _check_stick(rig: Rig) -> None:
    cup, stick, stirring = rig.cup, rig.stick, rig.stirring
    tip = stirring.height - stick.length
    if not 0.0 < tip < cup.fill:
        raise ValueError(
            f"stirring.height: the stick's tip is {tip:.3f} m above the floor, "
            f"outside the liquid (cup.fill = {cup.fill} m)"
        )
    if stirring.radius + stick.radius >= cup.radius:
        raise ValueError(
            f"stirring.radius {stirring.radius} m brings the stick to the cup's wall "
            f"(cup.radius = {cup.radius} m)"
        )
    if stick.mass >= rig.robot.payload:
        raise ValueError(
            f"stick.mass {stick.mass} kg is not below robot.payload {rig.robot.payload} kg, of "
            "which the stick is a part"
        )
    wet = cup.fill - tip
    lifted = rig.liquid.density * np.pi * stick.radius**2 * wet * (stick.length - wet / 2)
    if lifted >= stick.mass * stick.length / 2:  # moments about the pivot
        raise ValueError(
            f"stick.mass {stick.mass} kg: the stick floats up in a liquid of "
            f"{rig.liquid.density:g} kg/m3 (liquid.density); it must hang"
        )


def _check_heights(rig: Rig) -> None:
    stick, stirring, box = rig.stick, rig.stirring, rig.limits.stirring
    if box.z[0] <= stick.length:
        raise ValueError(
            f"limits.stirring.z {box.z[0]} m lets the stick's tip reach the "
            f"cup's floor (stick.length = {stick.length} m)"
        )
    if stirring.clear_height - stick.length <= rig.cup.height:
        raise ValueError(
            f"stirring.clear_height {stirring.clear_height} m leaves the stick in the cup"
        )
    for name in ("height", "clear_height"):
        height = getattr(stirring, name)
        if not box.z[0] <= height <= box.z[1]:
            raise ValueError(
                f"stirring.{name} {height} m is outside of limits.stirring.z {list(box.z)} m"
            )
