"""Output variables of RTDE: which there are, their types, and their values of the moment."""

import struct
from collections.abc import Callable
from typing import NamedTuple

from .registers import REGISTER_COUNT
from .snapshot import Snapshot
from .wire import layout

_ZEROS = (0.0,) * 6


class Field(NamedTuple):
    """A variable: its type's name, its value, and the first version that has it on e-Series."""

    type: str
    value: Callable[[Snapshot], tuple]
    since: tuple[int, int] = (0, 0)
    on_cb3: bool = True


def _constant(type: str, *values: float) -> Field:
    return Field(type, lambda _: values)


FIELDS: dict[str, Field] = {
    "timestamp": Field("DOUBLE", lambda s: (s.time,)),
    "target_q": Field("VECTOR6D", lambda s: s.joints),
    "target_qd": Field("VECTOR6D", lambda s: s.joint_speeds),
    "target_qdd": _constant("VECTOR6D", *_ZEROS),
    "target_current": _constant("VECTOR6D", *_ZEROS),
    "target_moment": _constant("VECTOR6D", *_ZEROS),
    "actual_q": Field("VECTOR6D", lambda s: s.joints),
    "actual_qd": Field("VECTOR6D", lambda s: s.joint_speeds),
    "actual_current": _constant("VECTOR6D", *_ZEROS),
    "actual_moment": _constant("VECTOR6D", *_ZEROS),
    "joint_control_output": _constant("VECTOR6D", *_ZEROS),
    "actual_TCP_pose": Field("VECTOR6D", lambda s: s.pose),
    "actual_TCP_speed": Field("VECTOR6D", lambda s: s.velocity),
    "actual_TCP_force": Field("VECTOR6D", lambda s: s.force),
    "target_TCP_pose": Field("VECTOR6D", lambda s: s.pose),
    "target_TCP_speed": Field("VECTOR6D", lambda s: s.velocity),
    "ft_raw_wrench": Field("VECTOR6D", lambda s: s.force, (5, 9), on_cb3=False),
    "actual_digital_input_bits": _constant("UINT64", 0),
    "actual_digital_output_bits": Field("UINT64", lambda s: (s.digital_outputs,)),
    "joint_temperatures": _constant("VECTOR6D", *(30.0,) * 6),
    "actual_execution_time": _constant("DOUBLE", 0.0),
    "robot_mode": _constant("INT32", 7),
    "joint_mode": _constant("VECTOR6INT32", *(253,) * 6),
    "safety_mode": Field("INT32", lambda s: (s.safety_mode,)),
    "actual_tool_accelerometer": _constant("VECTOR3D", 0.0, 0.0, 9.81),
    "speed_scaling": Field("DOUBLE", lambda s: (s.scaling,)),
    "target_speed_fraction": Field("DOUBLE", lambda s: (s.slider,)),
    "actual_momentum": _constant("DOUBLE", 0.0),
    "actual_main_voltage": _constant("DOUBLE", 48.0),
    "actual_robot_voltage": _constant("DOUBLE", 48.0),
    "actual_robot_current": _constant("DOUBLE", 1.0),
    "actual_joint_voltage": _constant("VECTOR6D", *(48.0,) * 6),
    "runtime_state": Field("UINT32", lambda s: (s.runtime_state,)),
    "robot_status_bits": Field("UINT32", lambda s: (s.robot_bits,)),
    "safety_status_bits": Field("UINT32", lambda s: (s.safety_bits,)),
    "standard_analog_input0": _constant("DOUBLE", 0.0),
    "standard_analog_input1": _constant("DOUBLE", 0.0),
    "standard_analog_output0": Field("DOUBLE", lambda s: s.analog_outputs[:1]),
    "standard_analog_output1": Field("DOUBLE", lambda s: s.analog_outputs[1:]),
    "payload": Field("DOUBLE", lambda s: (s.payload,), (5, 6)),
    "payload_cog": Field("VECTOR3D", lambda s: s.payload_centre, (5, 6)),
    "payload_inertia": Field("VECTOR6D", lambda _: _ZEROS, (5, 11)),
    **{
        f"output_int_register_{i}": Field("INT32", lambda s, i=i: s.output_ints[i : i + 1])
        for i in range(REGISTER_COUNT)
    },
    **{
        f"output_double_register_{i}": Field("DOUBLE", lambda s, i=i: s.output_doubles[i : i + 1])
        for i in range(REGISTER_COUNT)
    },
}


def find(name: str, version: tuple[int, int]) -> Field | None:
    """The variable of that name, if a controller of that version has it."""
    field = FIELDS.get(name)
    if field is None or not (field.on_cb3 if version[0] == 3 else version >= field.since):
        return None
    return field


class Recipe:
    """Variables that a client asked for, in its order."""

    def __init__(self, fields: list[Field]):
        self._layout: struct.Struct = layout([field.type for field in fields])
        self._values = [field.value for field in fields]

    def pack(self, snapshot: Snapshot) -> bytes:
        """Payload of a data package; outputs have the single recipe 1."""
        flat: list = [1]
        for value in self._values:
            flat.extend(value(snapshot))
        return self._layout.pack(*flat)
