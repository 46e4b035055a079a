"""Proposals of further stirs and pours."""

from typing import TYPE_CHECKING

import numpy as np

from ..inputs.recording import planned_recording
from ..inputs.strokes import speed
from ..simulators import PourSimulator, StirSimulator
from .pour_noise import PourNoise
from .pours import OUTCOMES, Fractions

if TYPE_CHECKING:
    from ..inference.criticism import ModelError, Noise, Proposal
    from ..models import Cups

FASTER_FACTOR, SLOWER_FACTOR = 1.6, 0.5
"""Speeds of proposed stirs, relative to the recording's."""

MAX_SPEED = 0.2
"""Of a proposed stir [m/s]."""

MAX_RADIUS_SHARE = 0.8
"""Of the way from the axis to the wall that the stick may go."""


def stir_proposals(
    stirring: StirSimulator, noise: "Noise", usual: "ModelError | None"
) -> list["Proposal"]:
    """The first recording's rig on other paths, seen with the same cameras' noise.

    Args:
        usual: What is usual for this simulator on other paths, if it is known.
    """
    from ..hardware.motion import circle, star
    from ..inference.criticism import Proposal, SumOfNoises

    all_noise = noise if usual is None else SumOfNoises((noise, usual))
    recording, setup = stirring.recordings[0], stirring.setups[0]
    fast = float(np.quantile(speed(recording), 0.95))
    height = float(recording.gripper.position[0, 2])
    position = recording.gripper.position[:, :2]
    wide = float(np.linalg.norm(position, axis=1).max())
    most = MAX_RADIUS_SHARE * (setup.cup.radius - setup.stick.radius)
    radius = min(max(wide, 0.01), most)
    faster, slower = min(FASTER_FACTOR * fast, MAX_SPEED), SLOWER_FACTOR * fast
    paths = {
        f"the star at {100 * faster:.0f} cm/s": star(speed=faster, height=height, radius=radius),
        f"the star at {100 * slower:.0f} cm/s": star(speed=slower, height=height, radius=radius),
        f"a star of 7 points at {100 * fast:.0f} cm/s": star(
            speed=fast, height=height, radius=0.8 * radius, points=7
        ),
        f"four circles at {100 * fast:.0f} cm/s": circle(
            speed=fast, height=height, radius=0.8 * radius
        ),
    }
    made = []
    for label, path in paths.items():
        plan = planned_recording(path.time, path.position, recording.attrs)
        own = StirSimulator((plan,), (setup,))
        shape = (len(path.time), 2)
        made.append(Proposal(own.batched, all_noise, shape, own.identity, label))
    return made


def pour_proposals(cups: "Cups", density: float, tried: int = 2) -> list["Proposal"]:
    """Pours at the slowest and at middling angular velocities, from two distances each."""
    from ..inference.criticism import Proposal

    rates = np.linspace(*cups.angular_velocity_range, tried + 1)[:tried]
    made = []
    for rate in rates:
        distance = np.linspace(*cups.distance_range, 4)[1:3]
        actions = Fractions(np.full(len(distance), rate), distance)
        pours = PourSimulator(cups, density, actions)
        label = f"pours at {np.degrees(rate):.0f} deg/s from " + " and ".join(
            f"{100 * d:.1f}" for d in distance
        )
        made.append(
            Proposal(
                pours.batched,
                PourNoise(actions.angular_velocity, actions.distance),
                (len(OUTCOMES), len(distance)),
                pours.identity,
                f"{label} cm",
            )
        )
    return made
