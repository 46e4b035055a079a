"""Messages between the main process and the control process."""

import hashlib
from multiprocessing.connection import Connection
from typing import NamedTuple

import numpy as np

from ..arm import Controller, Tool
from ..motion.stir_paths import PosePath
from ..rig import Rig
from ..safety.guards import Reading
from ..safety.preflight import Check


class Assignment(NamedTuple):
    """Task of a control process.

    Attributes:
        rig: Its limits and its robot.
        controller: Opens the arm.
        tool: What is in the gripper.
        armed: Whether it may move the arm; otherwise it only looks.
        directory: Of the recording, as text.
        probes: Poses of the plan in the base frame, shape (N, 6), about which the controller's
            own safety limits are asked.
        cameras: Whether both cameras belong to the session.
    """

    rig: Rig
    controller: Controller
    tool: Tool
    armed: bool
    directory: str
    probes: np.ndarray
    cameras: bool = True


class Follow(NamedTuple):
    """Follow a path; one that comes while another runs waits for its turn."""

    path: PosePath


class Stop(NamedTuple):
    """Stop the arm for good."""

    reason: str


class Ask(NamedTuple):
    """Tell the guards' readings."""


class Leave(NamedTuple):
    """Let go of the arm, which is at rest, and end."""


Order = Follow | Stop | Ask | Leave


class Checked(NamedTuple):
    """The pre-flight list; with no failure in it, the arm takes orders.

    Attributes:
        checks: The list.
        pose: Tool in the base frame, shape (6,); None without a connection.
        joints: [rad], shape (6,); likewise.
    """

    checks: list[Check]
    pose: np.ndarray | None
    joints: np.ndarray | None


class Told(NamedTuple):
    """Answer to `Ask`: the latest readings, and the tool's pose in the base frame."""

    readings: tuple[Reading, ...]
    pose: np.ndarray


class Began(NamedTuple):
    """A path has begun, the `number`th from 0, at this time of the controller's clock [s]."""

    number: int
    robot_time: float


class Done(NamedTuple):
    """A path has ended, as `Began`."""

    number: int
    robot_time: float


class Stopped(NamedTuple):
    """The arm was stopped for good."""

    reason: str
    guard: str


class Left(NamedTuple):
    """The control process ends as told."""


Report = Checked | Told | Began | Done | Stopped | Left


def report_to(orders: Connection, report: Report) -> None:
    """Tell main, if it is still there."""
    try:
        orders.send(report)
    except OSError:
        pass  # main is gone, which the inbox tells


def fingerprint(path: PosePath) -> str:
    """SHA-256 of a path's numbers, in hexadecimal: what an event tells of it."""
    digest = hashlib.sha256(np.ascontiguousarray(path.time).tobytes())
    digest.update(np.ascontiguousarray(path.pose).tobytes())
    return digest.hexdigest()
