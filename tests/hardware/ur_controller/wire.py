"""Packages of UR's Real-Time Data Exchange, protocol version 2 (big-endian)."""

import struct
from typing import NamedTuple

PACKAGE_HEADER = struct.Struct(">HB")  # size with this header, type

VERSION, CONTROLLER, TEXT, DATA = b"VvMU"
OUTPUTS, INPUTS, START, PAUSE = b"OISP"

PACKAGE_TYPES = {
    "UINT32": "I",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
}


class WireError(Exception):
    """The peer does not speak this protocol; its connection is closed."""


class Package(NamedTuple):
    type: int
    payload: bytes


def pack(type: int, payload: bytes) -> bytes:
    """A package as it goes over the wire."""
    return PACKAGE_HEADER.pack(PACKAGE_HEADER.size + len(payload), type) + payload


def take(buffer: bytearray) -> Package | None:
    """Remove the first whole package from `buffer`; None if there is none yet.

    Raises:
        WireError: The header gives a size that no package has.
    """
    if len(buffer) < PACKAGE_HEADER.size:
        return None
    size, kind = PACKAGE_HEADER.unpack_from(buffer)
    if size < PACKAGE_HEADER.size:
        raise WireError(f"a package of {size} bytes is shorter than its header")
    if len(buffer) < size:
        return None
    payload = bytes(buffer[PACKAGE_HEADER.size : size])
    del buffer[:size]
    return Package(kind, payload)


def layout(types: list[str]) -> struct.Struct:
    """Recipe number, then fields of these types."""
    return struct.Struct(">B" + "".join(PACKAGE_TYPES[kind] for kind in types))


def names(payload: bytes) -> list[str]:
    """Names of variables from a comma-separated list; ur_rtde ends it with a comma."""
    return [name for name in payload.decode("ascii", "replace").split(",") if name]
