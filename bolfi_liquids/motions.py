"""Stirs that could be made next: a family of motions, and the file that `record --motion` takes."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import tomli_w

from .files import write_text
from .inputs.recording import Recording, planned_recording
from .inputs.strokes import resting, speed
from .simulators import StirSimulator

if TYPE_CHECKING:
    from .hardware.motion import Trajectory
    from .inference.criticism import Noise, Proposal

FILE = "next_stir.toml"
"""In RUN, by `criticise`."""

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
        from .hardware.motion import Trajectory, circle, star

        if self.pattern == "circle":
            once = circle(speed=self.speed, height=self.height, radius=self.radius, rest=REST)
            still = once.time < REST, once.time > once.time[-1] - REST
            turned = np.tile(once.position[~(still[0] | still[1])], (self.cycles, 1))
            position = np.concatenate([once.position[still[0]], turned, once.position[still[1]]])
            return Trajectory(np.arange(len(position)) * once.time[1], position)
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
    a rig's file allows if it states no limits; but none is smaller or slower than any rig's file
    may say.
    """
    from .hardware.rig import StirringSettings
    from .inference.sobol import sobol

    recording, setup = stirring.recordings[0], stirring.setups[0]
    moves = recording.time[~resting(recording)]
    away = float(np.nanmax(np.linalg.norm(recording.gripper.position[:, :2], axis=1)))
    fast = float(np.nanquantile(speed(recording), 0.95))
    slow, fastest = (min(factor * fast, MAX_SPEED) for factor in SPEED_FACTORS)
    found = {}
    for k, (r, v, p, z) in enumerate(sobol(0, 0, count, 4).tolist()):
        points = PATTERNS[k % len(PATTERNS)]
        radius = away * (MIN_RADIUS_SHARE + (1.0 - MIN_RADIUS_SHARE) * r)
        radius = StirringSettings.within("radius", round(radius, 4))
        within = np.inf if points else (CIRCLE_SHARE * ACCELERATION * radius) ** 0.5
        once = Motion(
            pattern="star" if points else "circle",
            points=points or 9,
            radius=radius,
            speed=StirringSettings.within(
                "speed", round(min(slow + (fastest - slow) * v, within), 3)
            ),
            # up, so that none is deeper than the recording
            height=ceil(1e3 * (_height(recording) + MAX_RAISE * setup.submerged * z) - 1e-6) / 1e3,
            pause=round(max(0.0, MAX_PAUSE * (2.0 * p - 1.0)), 1) if points else 0.0,
            cycles=1,
        )
        cycles = round((moves[-1] - moves[0]) / (once.path.time[-1] - 2.0 * REST))
        motion = replace(once, cycles=StirringSettings.within("cycles", cycles))
        found[motion.label] = motion
    return list(found.values())


def _height(recording: Recording) -> float:
    """Of the gripper where it is first known [m]."""
    z = recording.gripper.position[:, 2]
    return float(z[np.isfinite(z)][0])


def planned(stirring: "StirSimulator", motion: Motion) -> StirSimulator:
    """The first recording's rig on another path."""
    recording, setup, path = stirring.recordings[0], stirring.setups[0], motion.path
    plan = planned_recording(path.time, path.position, recording.attrs)
    raised = motion.height - _height(recording)
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
    return [proposed(planned(stirring, motion), motion.label, noise) for motion in motions]


def proposed(plan: StirSimulator, label: str, noise: "Noise") -> "Proposal":
    """A stir of one recording as an experiment that could be made; its cost is its duration [s]."""
    from .inference.criticism import Proposal

    shape, duration = plan.observed.shape, float(np.ptp(plan.time))
    return Proposal(plan.batched, noise, shape, plan.identity_with_effects, label, duration)


def keep_motion(path: Path, motion: Mapping[str, Any] | None) -> None:
    """Write a motion file, or remove that of an earlier suggestion."""
    if motion is None:
        path.unlink(missing_ok=True)
    else:
        write_text(path, tomli_w.dumps(dict(motion)))
