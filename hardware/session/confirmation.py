"""An operator's leave to move the arm, which nothing but a typed sentence gives (S1)."""

from collections.abc import Sequence

import numpy as np

from ..arm import Tool
from ..errors import RigError
from ..motion.stir_paths import PosePath
from ..rig import Rig
from ..safety.limits import workspace

CONFIRMATION = "the arm may move"
_KEY = object()


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
            f"got {typed.strip()!r:.60}",
            where="confirmation",
            fix=f"type exactly: {CONFIRMATION}",
        )
    return Confirmation(_KEY, plan, address)


def describe(paths: Sequence[PosePath], rig: Rig, tool: Tool) -> str:
    """The plan as an operator reads it: where, how fast, how long."""
    box = workspace(rig, tool).box
    pose = np.concatenate([path.pose[:, :3] for path in paths])
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
