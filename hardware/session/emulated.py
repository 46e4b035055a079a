"""A rig whose robot is the emulator and whose cameras are rendered."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..board import check_can_start
from ..cameras.base import FrameSource
from ..emulator.process import EmulatorProcess
from ..emulator.stick_motion import StickMotion, checked, hanging_still
from ..errors import RigError
from ..motion.cup_frame import cup_frame
from ..motion.kinematics import inverse
from ..recorder.names import truth_file
from ..recorder.views import camera_model
from ..rig import Rig, View
from ..safety.limits import Tool, workspace

# what tells the emulated views apart
_SEEDS: dict[View, int] = {"xz": 1, "yz": 2}


@dataclass(frozen=True)
class HiddenLiquid:
    """What the emulated stick dips into; its density is the rig's.

    Attributes:
        viscosity: Dynamic [Pa s].
        seed: Of the pictures' noise and faults, and of the liquid's particles.
        stir: How the stick hangs while the liquid is stirred, in the cup's frame; None where
            nobody has simulated that: the stick hangs straight down.
    """

    viscosity: float = 1.0
    seed: int = 0
    stir: StickMotion | None = field(default=None, compare=False, repr=False)

    def __post_init__(self):
        if not (np.isfinite(self.viscosity) and self.viscosity > 0):
            raise RigError(
                f"{self.viscosity}",
                where="emulated viscosity",
                fix="give a positive, finite number",
            )


class EmulatedRig(NamedTuple):
    """A running emulator and the cameras that look at it.

    Attributes:
        emulator: The process.
        make_cameras: For each view, what opens its camera in the process that reads it.
    """

    emulator: EmulatorProcess
    make_cameras: dict[View, Callable[[], FrameSource]]


@contextmanager
def emulated(
    rig: Rig,
    pose: np.ndarray,
    *,
    address: str | None = None,
    tool: Tool = "stirring",
    liquid: HiddenLiquid | None = None,
    truth: Path | None = None,
) -> Iterator[EmulatedRig]:
    """Run an emulator of the rig's robot, at rest at a pose.

    Args:
        rig: Whose sizes, robot and cameras are emulated.
        pose: Of the tool's centre: position in the cup's frame [m], rotation vector in the base
            frame [rad], shape (6,).
        address: Where the emulator listens; one that is free if None.
        tool: What is in the gripper; a stick is seen by the cameras.
        liquid: Into which the stick dips.
        truth: Directory for what each frame truly showed, `truth_<view>.csv`; it exists.

    Raises:
        RigError: The arm does not reach `pose`, or the emulator does not start.
        ValueError: The liquid's `stir` is no motion of a stick.
    """
    check_can_start()
    liquid = HiddenLiquid() if liquid is None else liquid
    joints = _joints(rig, pose, tool)
    with EmulatorProcess.start(
        address,
        controller=rig.robot.controller,
        joints=joints,
        stick=_stick(rig, pose, liquid) if tool == "stirring" else None,
        options={"seed": liquid.seed, "tcp": json.dumps(list(workspace(rig, tool).tcp))},
    ) as emulator:
        cameras: dict[View, Callable[[], FrameSource]] = {
            view: RenderedView(rig, view, emulator.address, liquid.seed, truth) for view in _SEEDS
        }
        yield EmulatedRig(emulator, cameras)


class RenderedView(NamedTuple):
    """Opens the rendered camera of one view; can be sent to another process."""

    rig: Rig
    view: View
    address: str
    seed: int
    truth: Path | None

    def __call__(self) -> FrameSource:
        from ..cameras.rendered import RenderedCamera, Timing
        from ..rendering import BRIGHT_STICK, CupPlace, Look, Scene, StreamedWorld, prepare

        rig, camera = self.rig, self.rig.camera(self.view)
        scene = Scene(
            marker_offset=camera.marker,
            cup_radius=rig.cup.radius,
            cup_height=rig.cup.height,
            fill=rig.cup.fill,
            stick_radius=rig.stick.radius,
            stick_length=rig.stick.length,
            marker_radius=camera.marker_radius,
        )
        look = Look() if rig.stick.colour == "dark" else BRIGHT_STICK
        seed = 10 * self.seed + _SEEDS[self.view]
        stage = prepare(scene, camera_model(camera), look, seed)
        place = CupPlace(rig.cup.position, float(np.radians(rig.cup.yaw_deg)))
        timing = Timing(rate=camera.rate, seed=seed)
        truth = None if self.truth is None else self.truth / truth_file(self.view)
        return RenderedCamera(stage, StreamedWorld(self.address, place), timing, truth=truth)


def _stick(rig: Rig, pose: np.ndarray, liquid: HiddenLiquid) -> StickMotion:
    """How the stick hangs, in the base frame."""
    frame = cup_frame(rig.cup)
    if liquid.stir is None:
        return hanging_still(frame.to_base(pose))
    time, pivot, inclination = checked(liquid.stir)
    # inclinations in two planes turn as the tangents do, which are a direction's components
    turned = np.arctan(np.tan(inclination) @ frame.axes[:2, :2].T)
    return StickMotion(time, frame.origin + pivot @ frame.axes.T, turned)


def _joints(rig: Rig, pose: np.ndarray, tool: Tool) -> list[float]:
    space = workspace(rig, tool)
    found = inverse(space.arm, cup_frame(rig.cup).to_base(pose), space.start, tcp=space.tcp)
    if found.status == "unreachable":
        raise RigError(
            f"the arm does not reach {np.round(pose, 3).tolist()} of the cup's frame",
            where="rig.toml: cup.position",
            fix="place the cup nearer to the robot",
        )
    return [float(angle) for angle in found.joints]
