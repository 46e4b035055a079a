"""What a session is for, and whether it may move the arm."""

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
from ..motion.cup_frame import cup_frame
from ..motion.stir_paths import PosePath
from ..rig import Rig, View
from ..rig_file import checked_rig
from ..robot.orders import Assignment
from ..robot.ur import URController
from .confirmation import Confirmation

PROBED_POSES = 60  # poses of the plan about which the controller's own limits are asked


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
        """What opens the arm."""
        return URController(self.rig.robot.host) if self.arm is None else self.arm

    @property
    def rehearsal(self) -> bool:
        """Whether the arm is emulated: no confirmation is needed, and guards tolerate stalls."""
        # no other class may say so of itself: this is what spares the confirmation
        return type(self.arm) is EmulatedController

    @property
    def duration(self) -> float:
        """Of the plan [s]."""
        return sum(path.duration for path in self.plan)

    @cached_property
    def guarded_rig(self) -> Rig:
        """The rig by whose limits the arm is guarded; wider ones in a rehearsal.

        Raises:
            RigError: A number of the rig is not allowed, or they contradict each other.
        """
        rig = checked_rig(self.rig)
        return patient(rig) if self.rehearsal else rig

    def assignment(self) -> Assignment:
        """What the control process is for."""
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
        if self.armed and not self.rehearsal:
            _check_confirmation(self.confirmation, self.controller.address)


def _check_confirmation(confirmation: Confirmation | None, address: str) -> None:
    if not isinstance(confirmation, Confirmation):
        raise RigError(
            "armed without a confirmation",
            where="SessionSetup(armed=True)",
            fix="show the plan and pass confirm(plan, typed, address)",
        )
    if confirmation.address != address:
        raise RigError(
            f"the confirmation is for {confirmation.address}, the controller is at {address}",
            where="SessionSetup(confirmation=...)",
            fix="confirm the plan for this controller",
        )
    if confirmation.used:
        raise RigError(
            "the confirmation was for an earlier session",
            where="SessionSetup(confirmation=...)",
            fix="show the plan again and pass what confirm returns then",
        )


def _probes(plan: Sequence[PosePath], rig: Rig) -> np.ndarray:
    if not plan:
        return np.empty((0, 6))
    pose = np.concatenate([path.pose for path in plan])
    chosen = np.unique(np.linspace(0, len(pose) - 1, PROBED_POSES).astype(int))
    return cup_frame(rig.cup).to_base(pose[chosen])
