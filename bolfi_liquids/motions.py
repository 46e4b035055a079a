"""Stirs that could be made next: a family of motions, and the file that `record --motion` takes."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import tomli_w

from .files import write_text
from .inputs.recording import planned_recording
from .inputs.strokes import resting, speed
from .simulators import StirSimulator

if TYPE_CHECKING:
    from .hardware.motion import Trajectory
    from .inference.criticism import Noise, Proposal

FILE = "next_stir.toml"
"""In RUN."""

PATTERNS = 9, 0, 2, 5
"""Vertices of a star, or 2 of a line; 0 is a circle."""

MIN_RADIUS_SHARE = 0.4
"""Of the recording's radius; a wider stir is not proposed."""

SPEED_FACTORS = 0.5, 1.6
"""Of the recording's speed."""

MAX_SPEED, ACCELERATION = 0.15, 0.5
"""Of a proposed stir [m/s], [m/s2]: the limits of a rig's file that states none."""

CIRCLE_SHARE = 0.6
"""Of that acceleration, to which a circle's speed leads; its ways in and out need the rest."""

MAX_PAUSE = 0.6
"""At each vertex [s]; half of the motions have none."""

MAX_RAISE = 0.4
"""Of the submerged length of the stick."""

REST = 0.5
"""Before and after a stir that is only simulated [s]; `record` rests as the rig's file says."""


@dataclass(frozen=True)
class Motion:
    """The plan of a stir: fields of [stirring] in a rig's file."""

    pattern: Literal["star", "circle"]
    points: int
    radius: float
    speed: float
    height: float
    pause: float
    cycles: int
    acceleration: float = ACCELERATION

    @property
    def path(self) -> "Trajectory":
        """Of the gripper, thirty times a second."""
        from .hardware.motion import circle, star

        if self.pattern == "circle":
            return circle(speed=self.speed, height=self.height, radius=self.radius, rest=REST)
        named = {name: value for name, value in asdict(self).items() if name != "pattern"}
        return star(**named, rest=REST)

    @property
    def label(self) -> str:
        """What to do, for a person."""
        star = "lines" if self.points == 2 else f"a star of {self.points} points"
        parts = [
            f"{'circles' if self.pattern == 'circle' else star} at {100 * self.speed:.1f} cm/s",
            f"{100 * self.radius:.1f} cm from the axis",
            *([f"resting {self.pause:g} s at each end"] if self.pause else []),
            f"the pivot {100 * self.height:.1f} cm above the floor",
        ]
        return ", ".join(parts)


def family(stirring: "StirSimulator", count: int) -> list[Motion]:
    """Motions all over the family, each about as long as the first recording's stir.

    They go no farther from the axis than the recording, and within the speed and acceleration that
    a rig's file allows if it states no limits.
    """
    from .inference.sobol import sobol

    recording, setup = stirring.recordings[0], stirring.setups[0]
    position, moves = recording.gripper.position, recording.time[~resting(recording)]
    away = float(np.linalg.norm(position[:, :2], axis=1).max())
    fast = float(np.quantile(speed(recording), 0.95))
    slow, fastest = (min(factor * fast, MAX_SPEED) for factor in SPEED_FACTORS)
    found = {}
    for k, (r, v, p, z) in enumerate(sobol(0, 0, count, 4).tolist()):
        points = PATTERNS[k % len(PATTERNS)]
        radius = away * (MIN_RADIUS_SHARE + (1.0 - MIN_RADIUS_SHARE) * r)
        within = np.inf if points else (CIRCLE_SHARE * ACCELERATION * radius) ** 0.5
        once = Motion(
            pattern="star" if points else "circle",
            points=points or 9,
            radius=round(radius, 4),
            speed=round(min(slow + (fastest - slow) * v, within), 3),
            height=round(float(position[0, 2]) + MAX_RAISE * setup.submerged * z, 3),
            pause=round(max(0.0, MAX_PAUSE * (2.0 * p - 1.0)), 1) if points else 0.0,
            cycles=1,
        )
        cycles = round((moves[-1] - moves[0]) / (once.path.time[-1] - 2.0 * REST))
        motion = replace(once, cycles=max(cycles, 1))
        found[motion.label] = motion
    return list(found.values())


def planned(stirring: "StirSimulator", motion: Motion) -> StirSimulator:
    """The first recording's rig on another path."""
    recording, setup, path = stirring.recordings[0], stirring.setups[0], motion.path
    plan = planned_recording(path.time, path.position, recording.attrs)
    raised = motion.height - float(recording.gripper.position[0, 2])
    return StirSimulator((plan,), (replace(setup, submerged=setup.submerged - raised),))


def stir_proposals(
    stirring: "StirSimulator", motions: Sequence[Motion], noise: "Noise"
) -> list["Proposal"]:
    """Motions as experiments.

    Args:
        stirring: What was recorded.
        motions: Of the gripper.
        noise: Of the cameras, and the simulator's usual residual on other paths if it is known.
    """
    from .inference.criticism import Proposal

    made = []
    for motion in motions:
        plan, cost = planned(stirring, motion), float(motion.path.time[-1])
        shape = plan.observed.shape
        made.append(
            Proposal(plan.batched, noise, shape, plan.identity_with_effects, motion.label, cost)
        )
    return made


def keep_motion(run: Path, motion: Mapping[str, Any] | None) -> None:
    """Write RUN/next_stir.toml, or remove that of an earlier suggestion."""
    if motion is None:
        (run / FILE).unlink(missing_ok=True)
    else:
        write_text(run / FILE, tomli_w.dumps(dict(motion)))
