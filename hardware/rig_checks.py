"""Contradictions between the numbers of a rig, each of which is within its ends.

A stick hangs from a gripper that points down, a source cup is upright before it pours, and `start`
are the joints that a person read off with the stick's pivot above the cup: they say independently
where the cup stands.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .motion.cup_frame import cup_frame
from .motion.kinematics import forward, inverse
from .motion.poses import rotation_matrix
from .motion.stir_paths import above_cup
from .rig import MIN_CUP_RADIUS, AxisLimits, Camera, Rig
from .rig_numbers import RigFault
from .safety.limits import MAX_TILT, Workspace, workspace

CONTROLLER_RATE = {"cb3": 125.0, "e-series": 500.0}  # Hz; others are rounded by the controller
MIN_STICK_DENSITY = 300.0  # [kg/m3]; balsa and cork are lighter, and swim
MAX_STICK_DENSITY = 25_000.0  # [kg/m3]; no stick is denser
MIN_LOOK = 0.05  # [m], from a camera to what it looks at
LARGEST_BOX = {
    # above a cup of a hand's size, with a stick of a forearm's length
    "stirring": AxisLimits(x=(-0.2, 0.2), y=(-0.2, 0.2), z=(0.05, 1.0)),
    # an arm's length about the cup, never below the table
    "pouring": AxisLimits(x=(-1.0, 1.0), y=(-1.0, 1.0), z=(0.0, 1.0)),
}
"""Where a tool may be let go at most, in the cup's frame: the arm works beside people."""
LEVEL_TILT = np.radians(20.0)  # of a gripper that holds a source cup, from level
LIP_AWAY = 0.005  # m, of a source's lip from the gripper's axis, above it and towards the receiver
MAX_MARKER_AWAY = 0.15  # m, of a marker on the gripper from the stick's pivot
MAX_VIEW = np.radians(60.0)  # of a pivot from the middle of a picture; where the lens is measured
MAX_START_AWAY = 0.04  # m, of the pivot at `start` from its place above the cup; a cup is as wide

Faults = Iterator[RigFault]


class Clearance(NamedTuple):
    """How far the cup may stand from where a rig's file puts it before the stick meets it [m].

    Attributes:
        aside: From the stick at a vertex of the star to the cup's wall.
        along: From the stick's tip to the cup's floor while it stirs, or to the cup's rim while it
            is carried above it: the smaller of both.
    """

    aside: float
    along: float


def clearance(rig: Rig) -> Clearance:
    """Of the stick of a rig, on all ways that are planned with it; both are positive."""
    cup, stick, plan = rig.cup, rig.stick, rig.stirring
    floor = plan.height - stick.length
    rim = plan.clear_height - stick.length - cup.height
    return Clearance(cup.radius - plan.radius - stick.radius, min(floor, rim))


def contradictions(rig: Rig) -> Faults:
    """Contradictions in the order of checking; a later one may follow from an earlier one.

    Args:
        rig: Whose numbers are each within their ends.
    """
    yield from _sections(rig)
    for check in (_cameras_apart, _speeds, _stick, _heights):
        yield from (RigFault("", what) for what in check(rig))
    if fault := receiver_fault(rig, MIN_CUP_RADIUS):
        yield RigFault("", fault)
    for number, camera in enumerate(rig.cameras):
        yield from _camera(rig, camera, f"cameras.{number}")
    yield from _tracking(rig)
    yield from _stirring_tool(workspace(rig, "stirring"))
    yield from _source_cup(rig, workspace(rig, "pouring"))
    yield from _start(rig, workspace(rig, "stirring"))


def receiver_fault(rig: Rig, radius: float) -> str:
    """Message if a receiver overlaps the stirred cup, else an empty string.

    Args:
        rig: Says where both stand.
        radius: Of the receiver [m], which is not the rig's but that of the cups that are poured
            with.
    """
    apart = float(np.hypot(*np.subtract(rig.pouring.receiver[:2], rig.cup.position[:2])))
    if apart > rig.cup.radius + radius:
        return ""
    return (
        f"pouring.receiver is {apart:.3f} m from cup.position: it stands in the stirred cup "
        f"(cup.radius = {rig.cup.radius} m, the receiver's is at least {radius:g} m)"
    )


def _sections(rig: Rig) -> Faults:
    """Contradictions within one section."""
    robot, cup, stick = rig.robot, rig.cup, rig.stick
    if (base := CONTROLLER_RATE[robot.controller]) % robot.rate:
        what = f"rate {robot.rate:g} Hz does not divide the controller's {base:g} Hz; use 125"
        yield RigFault("robot", what)
    if cup.fill >= cup.height:
        yield RigFault("cup", f"fill {cup.fill} m is not below height {cup.height} m")
    if stick.density > MAX_STICK_DENSITY:
        yield RigFault("stick", f"mass {stick.mass:g} kg looks like grams; convert it to kg")
    if stick.density < MIN_STICK_DENSITY:
        what = (
            f"mass {stick.mass:g} kg is a density of {stick.density:.3g} kg/m3, which no stick "
            f"has (at least {MIN_STICK_DENSITY:g}); weigh it in kg"
        )
        yield RigFault("stick", what)
    if (points := rig.stirring.points) % 2 == 0:
        what = f"{points} is even: all strokes would lie on one line; give an odd number"
        yield RigFault("stirring.points", what)
    yield from _boxes(rig)
    for number, camera in enumerate(rig.cameras):
        if camera.intrinsics is None and camera.focal_length is None:
            yield RigFault(f"cameras.{number}", "neither intrinsics nor focal_length is given")
        if np.linalg.norm(np.subtract(camera.target, camera.position)) < MIN_LOOK:
            what = f"position and target are less than {MIN_LOOK:g} m apart"
            yield RigFault(f"cameras.{number}", what)


def _boxes(rig: Rig) -> Faults:
    for name, most in LARGEST_BOX.items():
        box: AxisLimits = getattr(rig.limits, name)
        for axis in ("x", "y", "z"):
            (low, high), (least, largest) = getattr(box, axis), getattr(most, axis)
            if not low < high:
                yield RigFault(f"limits.{name}", f"{axis} must ascend, got [{low}, {high}]")
            if low < least or high > largest:
                what = (
                    f"{name}.{axis} [{low}, {high}] m is not within [{least}, {largest}] m, "
                    "where an arm may be let go at most"
                )
                yield RigFault("limits", what)


def _cameras_apart(rig: Rig) -> Iterator[str]:
    first, second = rig.cameras
    if first.source == second.source and first.is_device:
        yield f"cameras: both have the source {first.source!r}; each needs its own"
    slowest = min(first.rate, second.rate)
    if rig.limits.frame_age < 1.0 / slowest:
        yield (
            f"limits.frame_age {rig.limits.frame_age} s is below the {1.0 / slowest:.3g} s from "
            "one picture of a camera to the next"
        )


def _speeds(rig: Rig) -> Iterator[str]:
    stirring, limits = rig.stirring, rig.limits
    limited = (
        ("stirring.speed", stirring.speed, "speed", "m/s"),
        ("stirring.approach_speed", stirring.approach_speed, "speed", "m/s"),
        ("pouring.approach_speed", rig.pouring.approach_speed, "speed", "m/s"),
        ("stirring.acceleration", stirring.acceleration, "acceleration", "m/s2"),
    )
    for name, value, limit, unit in limited:
        if value > (most := getattr(limits, limit)):
            yield f"{name} {value} {unit} is above limits.{limit} {most} {unit}"


def _stick(rig: Rig) -> Iterator[str]:
    cup, stick, stirring = rig.cup, rig.stick, rig.stirring
    tip = stirring.height - stick.length
    if not 0.0 < tip < cup.fill:
        yield (
            f"stirring.height: the stick's tip is {tip:.3f} m above the floor, "
            f"outside the liquid (cup.fill = {cup.fill} m)"
        )
    if stirring.radius + stick.radius >= cup.radius:
        yield (
            f"stirring.radius {stirring.radius} m brings the stick to the cup's wall "
            f"(cup.radius = {cup.radius} m)"
        )
    if stick.mass >= rig.robot.payload:
        yield (
            f"stick.mass {stick.mass} kg is not below robot.payload {rig.robot.payload} kg, of "
            "which the stick is a part"
        )
    wet = cup.fill - tip
    lifted = rig.liquid.density * np.pi * stick.radius**2 * wet * (stick.length - wet / 2)
    if lifted >= stick.mass * stick.length / 2:  # moments about the pivot
        yield (
            f"stick.mass {stick.mass} kg: the stick floats up in a liquid of "
            f"{rig.liquid.density:g} kg/m3 (liquid.density); it must hang"
        )


def _heights(rig: Rig) -> Iterator[str]:
    stick, stirring, z = rig.stick, rig.stirring, rig.limits.stirring.z
    if z[0] <= stick.length:
        yield (
            f"limits.stirring.z {z[0]} m lets the stick's tip reach the "
            f"cup's floor (stick.length = {stick.length} m)"
        )
    if stirring.clear_height - stick.length <= rig.cup.height:
        yield f"stirring.clear_height {stirring.clear_height} m leaves the stick in the cup"
    for name in ("height", "clear_height"):
        height = getattr(stirring, name)
        if not z[0] <= height <= z[1]:
            yield f"stirring.{name} {height} m is outside of limits.stirring.z {list(z)} m"


def _camera(rig: Rig, camera: Camera, name: str) -> Faults:
    position, pivot = np.array(camera.position), np.array([0.0, 0.0, rig.stirring.height])
    if np.hypot(*position[:2]) <= rig.cup.radius:
        yield RigFault(
            f"{name}.position",
            f"{list(camera.position)} m is on the cup's axis, or nearer to it than its wall",
            "measure it again, in the cup's frame: from the centre of its floor, z upwards",
        )
    if (away := float(np.linalg.norm(camera.marker))) > MAX_MARKER_AWAY:
        yield RigFault(
            f"{name}.marker",
            f"{list(camera.marker)} m is {away:.2f} m from the stick's pivot",
            f"measure it again, from the pivot: {MAX_MARKER_AWAY} m at the most",
        )
    ahead, there = np.subtract(camera.target, position), pivot - position
    angle = _angle(ahead / np.linalg.norm(ahead), there / np.linalg.norm(there))
    view = MAX_VIEW
    if camera.intrinsics is None and camera.focal_length is not None:
        view = float(np.arctan(np.hypot(camera.width, camera.height) / 2.0 / camera.focal_length))
    if angle > view:
        yield RigFault(
            f"{name}.target",
            f"the stick's pivot is {np.degrees(angle):.0f} deg from the middle of the picture, and "
            f"may be {np.degrees(view):.0f} deg",
            "correct it, position or stirring.height: the camera must see the stick",
        )


def _tracking(rig: Rig) -> Faults:
    """An arm lags along its way, which is level while it stirs."""
    aside = clearance(rig).aside
    if rig.limits.tracking_error >= aside:
        yield RigFault(
            "limits.tracking_error",
            f"{1e3 * rig.limits.tracking_error:.1f} mm, and the stick comes within "
            f"{1e3 * aside:.1f} mm of the cup's wall (cup.radius, stick.radius, stirring.radius)",
            "give less, 1 mm at least, or a smaller stirring.radius",
        )


def _stirring_tool(space: Workspace) -> Faults:
    for name, turn in _turns(space).items():
        tilt = _angle(turn[:, 2], (0.0, 0.0, -1.0))
        if tilt > MAX_TILT["stirring"]:
            yield RigFault(
                "robot.stirring_orientation",
                f"with it the {name} points {np.degrees(tilt):.0f} deg away from straight down",
                "correct it or the turn in robot.stirring_tcp: the stick hangs from it",
            )


def _source_cup(rig: Rig, space: Workspace) -> Faults:
    flange = _turns(space)["flange"]
    tilt = abs(np.arcsin(np.clip(flange[2, 2], -1.0, 1.0)))
    if tilt > LEVEL_TILT:
        yield RigFault(
            "robot.pouring_orientation",
            f"with it the flange points {np.degrees(tilt):.0f} deg away from level",
            "correct it or the turn in robot.pouring_tcp: the cup is held from a side",
        )
    heading = np.radians(rig.pouring.heading_deg)
    lip = flange[:, :2] @ space.tcp[:2]  # from the axis, wherever along it the cup is held
    ahead = float(lip @ (np.cos(heading), np.sin(heading), 0.0))
    for value, side in ((float(lip[2]), "above"), (ahead, "on the receiver's side of")):
        if value < LIP_AWAY:
            yield RigFault(
                "robot.pouring_tcp",
                f"with it the source's lip is {1e3 * value:.0f} mm {side} the gripper's axis, not "
                f"{1e3 * LIP_AWAY:.0f} mm or more",
                "correct it, robot.pouring_orientation or pouring.heading_deg: the cup must be "
                "upright, and turn towards the receiver",
            )


def _start(rig: Rig, space: Workspace) -> Faults:
    goal = cup_frame(rig.cup).to_base(above_cup(rig))
    if inverse(space.arm, goal, space.start, tcp=space.tcp) is None:
        yield RigFault(
            "cup.position",
            f"{list(rig.cup.position)} m: the arm does not reach the place above the cup",
            "correct it, or place the cup nearer to the robot",
        )
    at = forward(space.arm, space.start, tcp=space.tcp)
    x, y, z = (at - goal)[:3]
    aside, along, tilt = float(np.hypot(x, y)), float(abs(z)), _angle(_axis(at), _axis(goal))
    # two places of the cup that differ by more than the stick's clearance cannot both be safe
    wall, floor = np.minimum(clearance(rig), MAX_START_AWAY)
    if aside > wall or along > floor or tilt > MAX_TILT["stirring"]:
        yield RigFault(
            "robot.start",
            f"these joints put the stick's pivot {1e3 * aside:.1f} mm aside of its place above the "
            f"cup (cup.position, stirring.clear_height), {1e3 * along:.1f} mm from its height and "
            f"{np.degrees(tilt):.0f} deg from its direction, where this stick may be "
            f"{1e3 * wall:.1f} mm, {1e3 * floor:.1f} mm and "
            f"{np.degrees(MAX_TILT['stirring']):.0f} deg",
            "move the pivot there by hand and write down the joints, or correct "
            "cup.position, robot.stirring_tcp or robot.controller",
        )


def _turns(space: Workspace) -> dict[str, np.ndarray]:
    """Turn of the tool and of the flange that carries it, in the base frame, shape (3, 3)."""
    tool = rotation_matrix(space.orientation)
    return {"tool": tool, "flange": tool @ rotation_matrix(space.tcp[3:]).T}


def _axis(pose: np.ndarray) -> np.ndarray:
    """Where the tool at a pose points, shape (3,)."""
    return rotation_matrix(pose[3:])[:, 2]


def _angle(first: np.ndarray, second: "np.ndarray | tuple[float, ...]") -> float:
    """Between two directions of length 1 [rad]."""
    return float(np.arccos(np.clip(np.dot(first, second), -1.0, 1.0)))
