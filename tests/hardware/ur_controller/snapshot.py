"""The controller's state at one tick, as its servers publish it."""

from typing import NamedTuple


class Snapshot(NamedTuple):
    """What the controller knows at one tick, as plain numbers; SI units, base frame."""

    time: float
    host: float
    joints: tuple[float, ...]
    pose: tuple[float, ...]
    velocity: tuple[float, ...]
    force: tuple[float, ...]
    runtime_state: int
    safety_bits: int
    robot_bits: int
    payload: float
    payload_centre: tuple[float, ...]
    output_ints: tuple[int, ...]
    output_doubles: tuple[float, ...]
    resting: bool
