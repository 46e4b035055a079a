"""The controller's state at one tick, as its servers publish it."""

from typing import NamedTuple


class Snapshot(NamedTuple):
    """What the controller knows at one tick, as plain numbers; SI units, base frame."""

    time: float
    host: float
    joints: tuple[float, ...]
    joint_speeds: tuple[float, ...]
    pose: tuple[float, ...]
    velocity: tuple[float, ...]
    force: tuple[float, ...]
    runtime_state: int
    safety_mode: int
    safety_bits: int
    robot_bits: int
    slider: float
    scaling: float
    payload: float
    payload_centre: tuple[float, ...]
    digital_outputs: int
    analog_outputs: tuple[float, ...]
    output_ints: tuple[int, ...]
    output_doubles: tuple[float, ...]
    resting: bool
