"""Check of a rig: what works and what is missing; nothing moves."""

import socket
from collections.abc import Callable, Iterator
from contextlib import closing
from importlib.metadata import PackageNotFoundError, version

from ..cameras import CameraError, open_camera
from ..errors import RigError
from ..motion.stir_paths import insert, retract, stir
from ..rig import Camera, Rig
from ..robot.ur import URReader
from ..safety.limits import check_path
from ..safety.preflight import Check, controller_checks, place_check
from ..vision.stick_view import camera_model

RTDE_PORT = 30004
ANSWER_SECONDS = 2.0  # s
OPTIONAL_PACKAGES = (
    ("ur-rtde", "robot", "moves the robot"),
    ("opencv-python-headless", "cameras", "reads the cameras"),
    ("av", "cameras", "writes the videos"),
)


def check_rig(rig: Rig) -> list[Check]:
    """Packages, plan, cameras and robot, in this order; the robot is only looked at."""
    return [
        *(_package(*one) for one in OPTIONAL_PACKAGES),
        _plan(rig),
        *(check for camera in rig.cameras for check in _camera(camera)),
        *_robot(rig),
    ]


def _package(name: str, extra: str, use: str) -> Check:
    try:
        return Check(name, True, f"{version(name)}, {use}")
    except PackageNotFoundError:
        return Check(name, False, f"{use}: pip install 'bolfi-liquids[{extra}]'")


def _plan(rig: Rig) -> Check:
    path = stir(rig)
    try:
        for one in (insert(rig), path, retract(rig)):
            check_path(one, rig, "stirring")
    except RigError as err:
        return Check("plan", False, str(err))
    return Check("plan", True, f"{path.duration:.1f} s of stirring, within the limits")


def _camera(camera: Camera) -> Iterator[Check]:
    name = f"camera {camera.view}"
    yield _tried(f"{name}, lens", lambda: _lens(camera))
    yield _tried(f"{name}, picture", lambda: _picture(camera))


def _lens(camera: Camera) -> str:
    focal = camera_model(camera).focal[0]
    known = "calibrated" if camera.intrinsics else "not calibrated (rig calibrate-cameras)"
    return f"focal length {focal:.0f} px, {known}"


def _picture(camera: Camera) -> str:
    with closing(open_camera(camera)) as source:
        frame = source.read()
    if frame is None:
        raise CameraError(f"{camera.source!r} gives no picture")
    return f"{frame.image.shape[1]}x{frame.image.shape[0]} from {camera.source!r}"


def _robot(rig: Rig) -> Iterator[Check]:
    where = f"robot at {rig.robot.host}"
    try:
        socket.create_connection((rig.robot.host, RTDE_PORT), ANSWER_SECONDS).close()
    except OSError as err:
        yield Check(where, False, f"does not answer on port {RTDE_PORT}: {err.strerror or err}")
        return
    reader = URReader(rig.robot.host, rig.robot.rate)
    try:
        reader.connect()
        state = reader.read()
    except (ImportError, RigError) as err:
        yield Check(where, False, str(err))
        return
    finally:
        reader.close()
    yield Check(where, True, "answers")
    yield from controller_checks(state, rig)
    yield place_check(state, rig, "stirring")


def _tried(name: str, do: Callable[[], str]) -> Check:
    try:
        return Check(name, True, do())
    except (RigError, CameraError, ImportError) as err:
        return Check(name, False, str(err))
