"""A rig whose robot is emulated and whose cameras are rendered."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..arm import Tool
from ..cameras.base import FrameSource
from ..cameras.rendered import RenderedCamera, Timing
from ..errors import RigError
from ..motion.kinematics import inverse
from ..motion.poses import cup_frame
from ..process import REAL_CLOCK
from ..recorder.directory import truth_file
from ..rendering import BRIGHT_STICK, Look, SharedWorld, WorldState, prepare
from ..rig import Rig, View
from ..safety.limits import workspace
from ..vision.stick_view import camera_model, scene
from .arm import EmulatedController
from .stick import StickMotion, checked

# what tells the emulated views apart
_SEEDS: dict[View, int] = {"xz": 1, "yz": 2}
STALL_SECONDS = 1.0  # s, in which neither the arm nor its cameras move on


@dataclass(frozen=True)
class HiddenLiquid:
    """Liquid into which the emulated stick dips; its density is the rig's.

    Attributes:
        viscosity: Dynamic [Pa s].
        seed: Of the pictures' noise, and of the liquid's particles.
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
    """An emulated arm and the cameras that look at it, for one session.

    Attributes:
        controller: Opens the arm in the process that commands it.
        make_cameras: For each view, what opens its camera in the process that reads it.
        source: Where the data come from, for the recording.
    """

    controller: EmulatedController
    make_cameras: dict[View, Callable[[], FrameSource]]
    source: str


def emulated(
    rig: Rig,
    pose: np.ndarray,
    *,
    tool: Tool = "stirring",
    liquid: HiddenLiquid | None = None,
    truth: Path | None = None,
) -> EmulatedRig:
    """Emulate the rig's robot, at rest at a pose, and its cameras.

    Args:
        rig: Whose sizes, robot and cameras are emulated.
        pose: Of the tool's centre: position in the cup's frame [m], rotation vector in the base
            frame [rad], shape (6,).
        tool: What is in the gripper; a stick is seen by the cameras.
        liquid: Into which the stick dips.
        truth: Directory for what each frame truly showed, `truth_<view>.csv`; it exists when the
            cameras are opened.

    Raises:
        RigError: The arm does not reach `pose`.
        ValueError: The liquid's `stir` is no motion of a stick.
    """
    liquid = HiddenLiquid() if liquid is None else liquid
    joints, begun = _joints(rig, pose, tool), REAL_CLOCK.now()
    if tool == "pouring":
        controller = EmulatedController(joints, begun, tool, liquid.seed)
        return EmulatedRig(controller, {}, "emulated UR arm")
    stir = None if liquid.stir is None else checked(liquid.stir)
    world = SharedWorld(begun, WorldState(0.0, pose[:3], np.zeros(2)))
    cameras: dict[View, Callable[[], FrameSource]] = {
        view: partial(rendered_camera, rig, view, world, liquid.seed, truth) for view in _SEEDS
    }
    return EmulatedRig(
        EmulatedController(joints, begun, tool, liquid.seed, stir, world),
        cameras,
        f"emulated UR arm and rendered cameras, viscosity {liquid.viscosity} Pa s",
    )


def rendered_camera(
    rig: Rig, view: View, world: SharedWorld, seed: int, truth: Path | None
) -> RenderedCamera:
    """Open the rendered camera of one view, in the process that reads it."""
    camera = rig.camera(view)
    look = Look() if rig.stick.colour == "dark" else BRIGHT_STICK
    seed = 10 * seed + _SEEDS[view]
    stage = prepare(scene(rig, view), camera_model(camera), look, seed)
    timing = Timing(rate=camera.rate, seed=seed)
    return RenderedCamera(
        stage, world, timing, truth=None if truth is None else truth / truth_file(view)
    )


def patient(rig: Rig) -> Rig:
    """The rig with guards that do not mind a stall of this computer, for an emulated arm only.

    A real arm moves on in a stall. These limits are wider than a rig's file may ask for.
    """
    wider = {"overrun": STALL_SECONDS, "frame_age": STALL_SECONDS}
    return rig.model_copy(update={"limits": rig.limits.model_copy(update=wider)})


def _joints(rig: Rig, pose: np.ndarray, tool: Tool) -> tuple[float, ...]:
    space = workspace(rig, tool)
    found = inverse(space.arm, cup_frame(rig.cup).to_base(pose), space.start, tcp=space.tcp)
    if found is None:
        raise RigError(
            f"the arm does not reach {np.round(pose, 3).tolist()} of the cup's frame",
            where="rig.toml: cup.position",
            fix="place the cup nearer to the robot",
        )
    return tuple(found.tolist())
