"""Set-up of a session, and leave to move the arm, which a typed sentence alone gives (S1)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from ..arm import Controller, Tool
from ..cameras.base import FrameSource
from ..emulated.arm import EmulatedController
from ..emulated.rig import patient
from ..errors import RigError
from ..motion.poses import cup_frame
from ..motion.stir_paths import PosePath
from ..rig import Rig, View
from ..rig_file import checked_rig
from ..robot.orders import Assignment
from ..robot.ur import URController
from ..safety.limits import workspace

CONFIRMATION = "the arm may move"
_KEY = object()
PROBED_POSES = 60  # poses of the plan about which the controller's own limits are asked


class Confirmation:
    """That a plan was read and allowed for one session; made by `confirm` alone.

    Attributes:
        plan: What was read.
        address: The controller's that it is good for.
        used: Whether a session has taken it.
    """

    def __init__(self, key: object, plan: str, address: str):
        if key is not _KEY:
            raise TypeError("a Confirmation comes from confirm(plan, typed, address) only")
        self.plan = plan
        self.address = address
        self.used = False


def confirm(plan: str, typed: str, address: str) -> Confirmation:
    """Leave to carry out a plan that was shown to whoever typed `typed`.

    Args:
        plan: As it was shown.
        typed: By the person.
        address: Of the controller whose arm may move.

    Raises:
        RigError: It is not the sentence.
    """
    if typed.strip() != CONFIRMATION:
        raise RigError(
            f"got {typed.strip()!r:.60}", where="confirmation", fix=f"type exactly: {CONFIRMATION}"
        )
    return Confirmation(_KEY, plan, address)


def describe(paths: Sequence[PosePath], rig: Rig, tool: Tool) -> str:
    """The plan as an operator reads it: where, how fast, how long."""
    box = workspace(rig, tool).box
    pose = np.concatenate([path.pose[:, :3] for path in paths])
    stirs_by_file = tool == "stirring" and rig.motion_file
    speed = max(_fastest(path) for path in paths)
    tilt, rate = np.max([_turning(path) for path in paths], axis=0)
    sides = ", ".join(
        f"{name} {100 * low:.1f} to {100 * high:.1f} cm (allowed {100 * least:.1f} to "
        f"{100 * most:.1f})"
        for name, low, high, least, most in zip(
            "xyz", pose.min(axis=0), pose.max(axis=0), box.low, box.high, strict=True
        )
    )
    return "\n".join(
        [
            f"{tool} with the arm at {rig.robot.host}: {len(paths)} motions, "
            f"{sum(path.duration for path in paths):.0f} s",
            f"the tool's centre in the cup's frame: {sides}",
            *([f"the stir is of the file {rig.motion_file}"] if stirs_by_file else []),
            "before that, from wherever the arm is: straight up, sideways, and down to the first",
            f"greatest speed {100 * speed:.1f} cm/s (allowed {100 * rig.limits.speed:.1f}), "
            f"force limit {rig.limits.force:.0f} N",
            f"greatest turn {tilt:.0f} deg, turning by up to {rate:.0f} deg/s (allowed "
            f"{rig.limits.tilt_rate_deg_s:.0f})",
            "Somebody must stand at the emergency stop. Software is not a safety function.",
        ]
    )


def _turning(path: PosePath) -> tuple[float, float]:
    """Greatest turn from a path's first pose [deg], and how fast it turns [deg/s]."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_rotvec(path.pose[:, 3:])
    turn = (turns[0].inv() * turns).magnitude().max()
    rate = (turns[:-1].inv() * turns[1:]).magnitude().max() / (path.time[1] - path.time[0])
    return float(np.degrees(turn)), float(np.degrees(rate))


def _fastest(path: PosePath) -> float:
    steps = np.linalg.norm(np.diff(path.pose[:, :3], axis=0), axis=1)
    return float(steps.max() / (path.time[1] - path.time[0]))


@dataclass(frozen=True)
class SessionSetup:
    """Rig, directory and permissions of one session; a dry run unless it is armed.

    Attributes:
        rig: What is there.
        directory: Of the recording; new or empty.
        arm: Opens the arm; the controller that the rig names if None.
        make_cameras: By view, what opens its camera in the process that reads it; both or none.
        tool: What is in the gripper.
        armed: Whether the arm may move.
        confirmation: What a person has typed after reading the plan; needed if armed, unless the
            arm is emulated.
        plan: What will be followed; the controller's own safety limits are asked about it.
        source: Where the data come from, for the recording.

    Raises:
        RigError: A real arm is armed without a confirmation for its controller.
    """

    rig: Rig
    directory: Path
    arm: Controller | None = None
    make_cameras: Mapping[View, Callable[[], FrameSource]] = field(default_factory=dict)
    tool: Tool = "stirring"
    armed: bool = False
    confirmation: Confirmation | None = None
    plan: Sequence[PosePath] = field(default=(), repr=False)
    source: str = "robot"

    def __post_init__(self) -> None:
        self._check_permission()

    @property
    def controller(self) -> Controller:
        """Opens the arm."""
        return URController(self.rig.robot.host) if self.arm is None else self.arm

    @property
    def rehearsal(self) -> bool:
        """Whether the arm is emulated: no confirmation is needed, and guards tolerate stalls."""
        # no other class may say so of itself: this is what spares the confirmation
        return type(self.arm) is EmulatedController

    @cached_property
    def guarded_rig(self) -> Rig:
        """The rig by whose limits the arm is guarded; wider ones in a rehearsal.

        Raises:
            RigError: A number of the rig is not allowed, or they contradict each other.
        """
        rig = checked_rig(self.rig)
        return patient(rig) if self.rehearsal else rig

    def assignment(self) -> Assignment:
        """Task of the control process."""
        return Assignment(
            rig=self.guarded_rig,
            controller=self.controller,
            tool=self.tool,
            armed=self.armed,
            directory=str(self.directory),
            probes=_probes(self.plan, self.rig),
            cameras=bool(self.make_cameras),
        )

    def take_confirmation(self) -> None:
        """Use the confirmation up: it is good for one session.

        Raises:
            RigError: There is none for this controller, or another session has taken it.
        """
        self._check_permission()
        if self.armed and self.confirmation is not None:
            self.confirmation.used = True

    def _check_permission(self) -> None:
        if not self.armed or self.rehearsal:
            return
        given, address = self.confirmation, self.controller.address
        again = "show the plan and pass what confirm(plan, typed, address) returns"
        if not isinstance(given, Confirmation):
            raise RigError("armed without a confirmation", where="SessionSetup", fix=again)
        if given.used or given.address != address:
            other = f"for {given.address}, the controller is at {address}"
            what = "for an earlier session" if given.used else other
            raise RigError(f"the confirmation is {what}", where="SessionSetup", fix=again)


def _probes(plan: Sequence[PosePath], rig: Rig) -> np.ndarray:
    if not plan:
        return np.empty((0, 6))
    pose = np.concatenate([path.pose for path in plan])
    chosen = np.unique(np.linspace(0, len(pose) - 1, PROBED_POSES).astype(int))
    return cup_frame(rig.cup).to_base(pose[chosen])
