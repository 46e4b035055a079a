"""Whether a rig's tools, joints and places can be true together: what single numbers cannot tell.

A stick hangs from a gripper that points down, a source cup is upright before it pours, and `start`
are the joints that a person read off with the stick's pivot above the cup: they say independently
where the cup stands.
"""

from typing import NamedTuple

import numpy as np

from .errors import RigError
from .motion.cup_frame import cup_frame
from .motion.kinematics import forward, inverse
from .motion.poses import rotation_matrix
from .motion.stir_paths import above_cup
from .rig import Camera, Rig
from .safety.limits import MAX_TILT, Workspace, workspace

LEVEL_TILT = np.radians(20.0)  # of a gripper that holds a source cup, from level
LIP_AWAY = 0.005  # m, of a source's lip from the gripper's axis, above it and towards the receiver
MAX_MARKER_AWAY = 0.15  # m, of a marker on the gripper from the stick's pivot
MAX_VIEW = np.radians(60.0)  # of a pivot from the middle of a picture; where the lens is measured
MAX_START_AWAY = 0.04  # m, of the pivot at `start` from its place above the cup; a cup is as wide


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


def check_geometry(rig: Rig, where: str = "rig") -> Rig:
    """The rig itself.

    Args:
        rig: Whose numbers are each within their ends.
        where: Its file, for messages.

    Raises:
        RigError: A tool points where it cannot, the cup is not where `start` leads to, the stick
            may meet the cup before the tracking guard stops the arm, or a camera does not see it.
    """
    for number, camera in enumerate(rig.cameras):
        _check_camera(rig, camera, f"{where}: cameras.{number}")
    _check_tracking(rig, where)
    _check_stirring_tool(workspace(rig, "stirring"), where)
    _check_source_cup(rig, workspace(rig, "pouring"), where)
    _check_start(rig, workspace(rig, "stirring"), where)
    return rig


def _check_stirring_tool(space: Workspace, where: str) -> None:
    for name, turn in _turns(space).items():
        tilt = _angle(turn[:, 2], (0.0, 0.0, -1.0))
        if tilt > MAX_TILT["stirring"]:
            raise RigError(
                f"with it the {name} points {np.degrees(tilt):.0f} deg away from straight down",
                where=f"{where}: robot.stirring_orientation",
                fix="correct it or the turn in robot.stirring_tcp: the stick hangs from it",
            )


def _check_tracking(rig: Rig, where: str) -> None:
    """An arm lags along its way, which is level while it stirs."""
    aside = clearance(rig).aside
    if rig.limits.tracking_error >= aside:
        raise RigError(
            f"{1e3 * rig.limits.tracking_error:.1f} mm, and the stick comes within "
            f"{1e3 * aside:.1f} mm of the cup's wall (cup.radius, stick.radius, stirring.radius)",
            where=f"{where}: limits.tracking_error",
            fix="give less, 1 mm at least, or a smaller stirring.radius",
        )


def _check_camera(rig: Rig, camera: Camera, where: str) -> None:
    position, pivot = np.array(camera.position), np.array([0.0, 0.0, rig.stirring.height])
    if np.hypot(*position[:2]) <= rig.cup.radius:
        raise RigError(
            f"{list(camera.position)} m is on the cup's axis, or nearer to it than its wall",
            where=f"{where}.position",
            fix="measure it again, in the cup's frame: from the centre of its floor, z upwards",
        )
    if (away := float(np.linalg.norm(camera.marker))) > MAX_MARKER_AWAY:
        raise RigError(
            f"{list(camera.marker)} m is {away:.2f} m from the stick's pivot",
            where=f"{where}.marker",
            fix=f"measure it again, from the pivot: {MAX_MARKER_AWAY} m at the most",
        )
    ahead, there = np.subtract(camera.target, position), pivot - position
    angle = _angle(ahead / np.linalg.norm(ahead), there / np.linalg.norm(there))
    view = MAX_VIEW
    if camera.intrinsics is None and camera.focal_length is not None:
        view = float(np.arctan(np.hypot(camera.width, camera.height) / 2.0 / camera.focal_length))
    if angle > view:
        raise RigError(
            f"the stick's pivot is {np.degrees(angle):.0f} deg from the middle of the picture, and "
            f"may be {np.degrees(view):.0f} deg",
            where=f"{where}.target",
            fix="correct it, position or stirring.height: the camera must see the stick",
        )


def _check_source_cup(rig: Rig, space: Workspace, where: str) -> None:
    flange = _turns(space)["flange"]
    tilt = abs(np.arcsin(np.clip(flange[2, 2], -1.0, 1.0)))
    if tilt > LEVEL_TILT:
        raise RigError(
            f"with it the flange points {np.degrees(tilt):.0f} deg away from level",
            where=f"{where}: robot.pouring_orientation",
            fix="correct it or the turn in robot.pouring_tcp: the cup is held from a side",
        )
    heading = np.radians(rig.pouring.heading_deg)
    lip = flange[:, :2] @ space.tcp[:2]  # from the axis, wherever along it the cup is held
    ahead = float(lip @ (np.cos(heading), np.sin(heading), 0.0))
    for value, side in ((float(lip[2]), "above"), (ahead, "on the receiver's side of")):
        if value < LIP_AWAY:
            raise RigError(
                f"with it the source's lip is {1e3 * value:.0f} mm {side} the gripper's axis, not "
                f"{1e3 * LIP_AWAY:.0f} mm or more",
                where=f"{where}: robot.pouring_tcp",
                fix="correct it, robot.pouring_orientation or pouring.heading_deg: the cup must be "
                "upright, and turn towards the receiver",
            )


def _check_start(rig: Rig, space: Workspace, where: str) -> None:
    goal = cup_frame(rig.cup).to_base(above_cup(rig))
    if inverse(space.arm, goal, space.start, tcp=space.tcp).status == "unreachable":
        raise RigError(
            f"{list(rig.cup.position)} m: the arm does not reach the place above the cup",
            where=f"{where}: cup.position",
            fix="correct it, or place the cup nearer to the robot",
        )
    at = forward(space.arm, space.start, tcp=space.tcp)
    x, y, z = (at - goal)[:3]
    aside, along, tilt = float(np.hypot(x, y)), float(abs(z)), _angle(_axis(at), _axis(goal))
    # two places of the cup that differ by more than the stick's clearance cannot both be safe
    wall, floor = np.minimum(clearance(rig), MAX_START_AWAY)
    if aside > wall or along > floor or tilt > MAX_TILT["stirring"]:
        raise RigError(
            f"these joints put the stick's pivot {1e3 * aside:.1f} mm aside of its place above the "
            f"cup (cup.position, stirring.clear_height), {1e3 * along:.1f} mm from its height and "
            f"{np.degrees(tilt):.0f} deg from its direction, where this stick may be "
            f"{1e3 * wall:.1f} mm, {1e3 * floor:.1f} mm and "
            f"{np.degrees(MAX_TILT['stirring']):.0f} deg",
            where=f"{where}: robot.start",
            fix="move the pivot there by hand and write down the joints, or correct "
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
