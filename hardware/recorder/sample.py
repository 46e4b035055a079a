"""What is recorded of the robot at each tick: the columns of samples.csv."""

from typing import NamedTuple

SAMPLES = "samples.csv"


class Sample(NamedTuple):
    """The robot at one tick of the motion loop.

    Attributes:
        index: Of the tick, without gaps.
        time: The controller's clock [s].
        host: The host's clock when it was read [s].
        x: Tool's centre in the cup's frame [m], as are `y` and `z`.
        rx: Its rotation vector in the base frame [rad], as are `ry` and `rz`.
        target_x: Where it was told to be [m]; NaN while nothing is commanded.
        fx: Force on the tool in the base frame [N], as are `fy` and `fz`.
        speed_scaling: The controller's, 1 at full speed.
        safety_bits: The controller's safety status.
        runtime_state: 2 while its program runs.
        stirring: 1 while the path belongs to the stir, 0 on the way there and back.
        late: By which the tick came late [s].
    """

    index: int  # pyright: ignore[reportIncompatibleMethodOverride]
    time: float
    host: float
    x: float
    y: float
    z: float
    rx: float
    ry: float
    rz: float
    target_x: float
    target_y: float
    target_z: float
    fx: float
    fy: float
    fz: float
    speed_scaling: float
    safety_bits: int
    runtime_state: int
    stirring: int
    late: float
