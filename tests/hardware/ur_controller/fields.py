"""Output variables of RTDE that our driver reads: their types, and their values of the moment."""

import struct
from collections.abc import Callable
from typing import NamedTuple

from .registers import REGISTER_COUNT
from .snapshot import Snapshot
from .wire import layout


class Field(NamedTuple):
    """A variable: its type's name, its value, and the first version that has it on e-Series."""

    type: str
    value: Callable[[Snapshot], tuple]
    since: tuple[int, int] = (0, 0)


FIELDS: dict[str, Field] = {
    "timestamp": Field("DOUBLE", lambda s: (s.time,)),
    "actual_q": Field("VECTOR6D", lambda s: s.joints),
    "actual_TCP_pose": Field("VECTOR6D", lambda s: s.pose),
    "actual_TCP_speed": Field("VECTOR6D", lambda s: s.velocity),
    "actual_TCP_force": Field("VECTOR6D", lambda s: s.force),
    "robot_mode": Field("INT32", lambda _: (7,)),
    "speed_scaling": Field("DOUBLE", lambda _: (1.0,)),
    "target_speed_fraction": Field("DOUBLE", lambda _: (1.0,)),
    "runtime_state": Field("UINT32", lambda s: (s.runtime_state,)),
    "robot_status_bits": Field("UINT32", lambda s: (s.robot_bits,)),
    "safety_status_bits": Field("UINT32", lambda s: (s.safety_bits,)),
    "payload": Field("DOUBLE", lambda s: (s.payload,), (5, 6)),
    "payload_cog": Field("VECTOR3D", lambda s: s.payload_centre, (5, 6)),
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
    return field if field is not None and (version[0] == 3 or version >= field.since) else None


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
