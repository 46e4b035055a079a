"""Reading a rig.toml, and refusing numbers that contradict each other.

A stick hangs from a gripper that points down, a source cup is upright before it pours, and `start`
are the joints that a person read off with the stick's pivot above the cup: they say independently
where the cup stands.
"""

import tomllib
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from importlib.resources import as_file, files
from pathlib import Path
from types import NoneType
from typing import Any, NamedTuple, get_args

import numpy as np
from pydantic import BaseModel, ValidationError

from .errors import RigError
from .motion.kinematics import forward, inverse
from .motion.poses import cup_frame, rotation_matrix
from .motion.stir_paths import above_cup
from .rig import CHECK_ENDS, MIN_CUP_RADIUS, MOTION_FIELDS, Camera, Rig
from .safety.limits import MAX_TILT, Workspace, workspace

BUNDLED = "rig.toml"
COMPARE = "compare with the bundled rig.toml (SI units unless the name says otherwise)"
LEVEL_TILT = np.radians(20.0)  # of a gripper that holds a source cup, from level
LIP_AWAY = 0.005  # m, of a source's lip from the gripper's axis, above it and towards the receiver
MAX_MARKER_AWAY = 0.15  # m, of a marker on the gripper from the stick's pivot
MAX_VIEW = np.radians(60.0)  # of a pivot from the middle of a picture; where the lens is measured
MAX_START_AWAY = 0.04  # m, of the pivot at `start` from its place above the cup; a cup is as wide


class RigFault(NamedTuple):
    """A fault of a rig.

    Attributes:
        field: Such as `robot.host`; empty if several fields are involved.
        what: Description, with the values.
        fix: Cure.
    """

    field: str
    what: str
    fix: str = COMPARE


def open_rig(path: str | Path) -> Rig:
    """Read a rig that a person wrote down.

    Paths in it (`intrinsics`, `source`, `driver`) count from the file's own directory.

    Raises:
        RigError: The file is missing or cannot be used; the message names the fields.
    """
    return _beside(_checked(_read(path, BUNDLED), str(path)), Path(path).parent)


def with_motion(rig: Rig, path: str | Path) -> Rig:
    """A rig that stirs as a motion file says: `MOTION_FIELDS` in the place of the rig's own.

    Raises:
        RigError: The rig or the file cannot be used, or the rig does not allow that motion.
    """
    checked_rig(rig)  # its own faults are not the file's
    written = _read(path, "motion file")
    for name in written:
        if name not in MOTION_FIELDS:
            raise RigError(
                "is no field of a motion",
                where=f"{path}: {name}",
                fix=f"a motion has {', '.join(MOTION_FIELDS)}, at the file's top without a heading",
            )
    stirring = rig.stirring.model_dump() | written
    return _checked(rig.model_dump() | {"stirring": stirring}, str(path)).stirred_by(str(path))


def _read(path: str | Path, kind: str) -> dict[str, Any]:
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError) as err:
        what = getattr(err, "strerror", None) or "not a text file"
        raise RigError(what, where=str(path), fix=f"give the path of a {kind}") from err
    except tomllib.TOMLDecodeError as err:
        raise RigError(f"not TOML: {err}", where=str(path), fix="correct that line") from err


def bundled_rig() -> Rig:
    """The rig that comes with the package; no robot answers at its address."""
    with as_file(files(f"{__package__}.data") / BUNDLED) as path:
        return open_rig(path)


def checked_rig(rig: Rig, where: str = "rig") -> Rig:
    """The rig itself: copies of a rig may hold numbers that its file may not.

    Raises:
        RigError: A number is not allowed, or they contradict each other.
    """
    _checked(rig.model_dump(), where)
    return rig


def _checked(written: dict[str, Any], where: str) -> Rig:
    """Rig of a file's content, after all checks."""
    try:
        rig = Rig.model_validate(written, context=CHECK_ENDS, extra="forbid")
    except ValidationError as err:
        what, place = named_faults(field_faults(err, Rig), where)
        raise RigError(what, where=place, fix=COMPARE) from err
    for field, what, fix in contradictions(rig):
        raise RigError(what, where=f"{where}: {field}" if field else where, fix=fix)
    return rig


def named_faults(faults: Iterable[RigFault], where: str) -> tuple[str, str]:
    """What is wrong and where, of one fault or of several independent ones."""
    several = [*faults]
    if len(several) > 1:
        return ", ".join(f"{field}: {what}" for field, what, _ in several), where
    ((field, what, _),) = several
    return what, f"{where}: {field}" if field else where


def field_faults(err: ValidationError, model: type[BaseModel]) -> Iterator[RigFault]:
    """Missing and unknown fields, wrong types, numbers beyond their ends.

    Args:
        err: Of the values of a file.
        model: What they should have been.
    """
    for one in err.errors(include_url=False, include_context=False):
        name, given = ".".join(map(str, one["loc"])), one["input"]
        what = one["msg"].removeprefix("Value error, ")
        if one["type"] == "missing":
            what = "is required, but missing"
        elif one["type"] == "extra_forbidden":
            *way, unknown = one["loc"]
            known = _section(model, way).model_fields
            likely = get_close_matches(str(unknown), known, n=1)
            hint = f"did you mean {likely[0]}?" if likely else f"known: {', '.join(known)}"
            what = f"no such field ({hint})"
        elif one["type"] != "value_error" and not isinstance(given, dict):
            what = f"{what}, got {given!r:.60}"
        yield RigFault(name, what)


def _section(model: type[BaseModel], way: list[int | str]) -> type[BaseModel]:
    """The part of a model to which names of fields, and indices into tuples, lead."""
    kind: Any = model
    for step in way:
        if isinstance(step, int):
            kinds = get_args(kind)
            kind = kinds[0] if kinds[-1] is ... else kinds[step]
        else:
            kind = kind.model_fields[step].annotation
        kinds = get_args(kind)
        kind = kinds[0] if kinds[1:] == (NoneType,) else kind
    return kind


def _beside(rig: Rig, directory: Path) -> Rig:
    def placed(camera: Camera, *names: str) -> Camera:
        given = {name: getattr(camera, name) for name in names}
        found = {k: str(directory / name) for k, name in given.items() if isinstance(name, str)}
        return camera.model_copy(update=found)

    # what `source` means is its driver's business
    names = [("intrinsics", "driver" if camera.driver else "source") for camera in rig.cameras]
    cameras = (placed(camera, *of) for camera, of in zip(rig.cameras, names, strict=True))
    return rig.model_copy(update={"cameras": tuple(cameras)})


# -- numbers that contradict each other, each of which is within its ends


class Clearance(NamedTuple):
    """Distances [m] by which the cup may be misplaced before the stick meets it.

    Attributes:
        aside: From the stick at a vertex of the star to the cup's wall.
        along: From the stick's tip to the cup's floor while it stirs, or to the cup's rim while it
            is carried above it: the smaller of both.
    """

    aside: float
    along: float


def clearance(rig: Rig) -> Clearance:
    """Clearance of a rig's stick on all ways that are planned with it; both are positive."""
    cup, stick, plan = rig.cup, rig.stick, rig.stirring
    floor = plan.height - stick.length
    rim = plan.clear_height - stick.length - cup.height
    return Clearance(cup.radius - plan.radius - stick.radius, min(floor, rim))


def contradictions(rig: Rig) -> Iterator[RigFault]:
    """Contradictions in the order of checking; a later one may follow from an earlier one.

    Args:
        rig: Whose numbers are each within their ends.
    """
    for rules in (_speeds, _stick, _heights, _receiver, _cameras, _tools, _start):
        yield from rules(rig)


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


def _receiver(rig: Rig) -> Iterator[RigFault]:
    if fault := receiver_fault(rig, MIN_CUP_RADIUS):
        yield RigFault("", fault)


def _speeds(rig: Rig) -> Iterator[RigFault]:
    for field, limit, unit in (
        ("stirring.speed", "speed", "m/s"),
        ("stirring.approach_speed", "speed", "m/s"),
        ("pouring.approach_speed", "speed", "m/s"),
        ("stirring.acceleration", "acceleration", "m/s2"),
    ):
        section, _, name = field.partition(".")
        value, most = getattr(getattr(rig, section), name), getattr(rig.limits, limit)
        if value > most:
            yield RigFault(field, f"{value} {unit} is above limits.{limit} {most} {unit}")


def _stick(rig: Rig) -> Iterator[RigFault]:
    cup, stick, stirring = rig.cup, rig.stick, rig.stirring
    tip, payload = stirring.height - stick.length, rig.robot.payload
    if not 0.0 < tip < cup.fill:
        where = f"the stick's tip is {tip:.3f} m above the floor, outside the liquid"
        yield RigFault("stirring.height", f"{where} (cup.fill = {cup.fill} m)")
    if stirring.radius + stick.radius >= cup.radius:
        wall = f"brings the stick to the cup's wall (cup.radius = {cup.radius} m)"
        yield RigFault("stirring.radius", f"{stirring.radius} m {wall}")
    if stick.mass >= payload:
        part = f"is not below robot.payload {payload} kg, of which the stick is a part"
        yield RigFault("stick.mass", f"{stick.mass} kg {part}")
    wet = cup.fill - tip
    lifted = rig.liquid.density * np.pi * stick.radius**2 * wet * (stick.length - wet / 2)
    if lifted >= stick.mass * stick.length / 2:  # moments about the pivot
        floats = f"floats up in a liquid of {rig.liquid.density:g} kg/m3; it must hang"
        yield RigFault("stick.mass", f"{stick.mass} kg {floats}")
    aside, error = clearance(rig).aside, rig.limits.tracking_error
    if error >= aside:  # an arm lags along its way, which is level while it stirs
        yield RigFault(
            "limits.tracking_error",
            f"{1e3 * error:.1f} mm, and the stick comes within {1e3 * aside:.1f} mm of the cup's "
            "wall (cup.radius, stick.radius, stirring.radius)",
            "give less, 1 mm at least, or a smaller stirring.radius",
        )


def _heights(rig: Rig) -> Iterator[RigFault]:
    stick, stirring, (low, high) = rig.stick, rig.stirring, rig.limits.stirring.z
    if low <= stick.length:
        floor = f"lets the stick's tip reach the cup's floor (stick.length = {stick.length} m)"
        yield RigFault("limits.stirring.z", f"{low} m {floor}")
    clear = stirring.clear_height
    if clear - stick.length <= rig.cup.height:
        yield RigFault("stirring.clear_height", f"{clear} m leaves the stick in the cup")
    for name in ("height", "clear_height"):
        height = getattr(stirring, name)
        if not low <= height <= high:
            outside = f"{height} m is outside of limits.stirring.z {[low, high]} m"
            yield RigFault(f"stirring.{name}", outside)


def _cameras(rig: Rig) -> Iterator[RigFault]:
    first, second = rig.cameras
    same = (first.driver, first.source) == (second.driver, second.source)
    if same and first.is_device:
        yield RigFault("cameras", f"both have the source {first.source!r}; each needs its own")
    between, age = 1.0 / min(first.rate, second.rate), rig.limits.frame_age
    if age < between:
        often = f"{age} s is below the {between:.3g} s from one picture of a camera to the next"
        yield RigFault("limits.frame_age", often)
    for number, camera in enumerate(rig.cameras):
        yield from _camera(rig, camera, f"cameras.{number}")


def _camera(rig: Rig, camera: Camera, name: str) -> Iterator[RigFault]:
    position, pivot = np.array(camera.position), np.array([0.0, 0.0, rig.stirring.height])
    if np.hypot(*position[:2]) <= rig.cup.radius:
        yield RigFault(
            f"{name}.position",
            f"{list(camera.position)} m is on the cup's axis, or nearer to it than its wall",
            "measure it again, in the cup's frame: from the centre of its floor, z upwards",
        )
    away = float(np.linalg.norm(camera.marker))
    if away > MAX_MARKER_AWAY:
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


def _tools(rig: Rig) -> Iterator[RigFault]:
    """A stick hangs from a tool that points down; a source cup is upright, and held from a side."""
    for name, turn in _turns(workspace(rig, "stirring")).items():
        tilt = _angle(turn[:, 2], (0.0, 0.0, -1.0))
        if tilt > MAX_TILT["stirring"]:
            yield RigFault(
                "robot.stirring_orientation",
                f"with it the {name} points {np.degrees(tilt):.0f} deg away from straight down",
                "correct it or the turn in robot.stirring_tcp: the stick hangs from it",
            )
    space = workspace(rig, "pouring")
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


def _start(rig: Rig) -> Iterator[RigFault]:
    space, goal = workspace(rig, "stirring"), cup_frame(rig.cup).to_base(above_cup(rig))
    if inverse(space.arm, goal, space.start, tcp=space.tcp) is None:
        yield RigFault(
            "cup.position",
            f"{list(rig.cup.position)} m: the arm does not reach the place above the cup",
            "correct it, or place the cup nearer to the robot",
        )
    at = forward(space.arm, space.start, tcp=space.tcp)
    x, y, z = (at - goal)[:3]
    aside, along = float(np.hypot(x, y)), float(abs(z))
    tilt = _angle(rotation_matrix(at[3:])[:, 2], rotation_matrix(goal[3:])[:, 2])
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


def _angle(first: np.ndarray, second: "np.ndarray | tuple[float, ...]") -> float:
    """Angle between two directions of length 1 [rad]."""
    return float(np.arccos(np.clip(np.dot(first, second), -1.0, 1.0)))
