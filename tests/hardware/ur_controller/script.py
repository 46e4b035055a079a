"""What the emulator understands of uploaded scripts: ur_rtde's control script and its paths."""

import re
from typing import Literal, NamedTuple

_NUMBER = r"[-+0-9.eEinfa]+"
_MOVE = re.compile(
    rf"^\s*(movej|movel)\((p?)\[({_NUMBER}(?:,{_NUMBER}){{5}})\],a=({_NUMBER}),v=({_NUMBER}),r="
)
_PROGRESS = re.compile(r"^\s*signal_async_progress\((\d+)\)")
_OFFSET = re.compile(r"# int register offset\n\s*(\d+)")
_PATH = re.compile(r"# inject move path\n(.*?)^\s*end\b", re.DOTALL | re.MULTILINE)
_END = re.compile(rb"^end[ \t\r]*\n", re.MULTILINE)


Kind = Literal["movej", "movel"]


class ScriptError(ValueError):
    """The script has something that the emulator does not do."""


class Waypoint(NamedTuple):
    """One motion of a path; `progress` is what the script reports before it."""

    kind: Kind
    is_pose: bool
    target: tuple[float, ...]
    speed: float
    acceleration: float
    progress: int | None


class Script(NamedTuple):
    """The control script: offset of its registers, and the path that was put into it."""

    offset: int
    path: tuple[Waypoint, ...]


def take(buffer: bytearray) -> str | None:
    """Remove the first whole script from `buffer`: it ends with `end` at the line's start."""
    found = _END.search(buffer)
    if found is None:
        return None
    text = bytes(buffer[: found.end()]).decode("utf-8", "replace")
    del buffer[: found.end()]
    return text


def parse(text: str) -> Script:
    """Read an uploaded script.

    Raises:
        ScriptError: It is not ur_rtde's control script, or its path has other than movej, movel.
    """
    offset, path = _OFFSET.search(text), _PATH.search(text)
    if offset is None or path is None:
        raise ScriptError(
            f"only ur_rtde's control script is emulated, not {text.strip().splitlines()[:1]}; "
            "try other scripts on URSim"
        )
    waypoints: list[Waypoint] = []
    progress = None
    for row in path[1].splitlines():
        move, report = _MOVE.match(row), _PROGRESS.match(row)
        if report:
            progress = int(report[1])
        elif move:
            target = tuple(float(value) for value in move[3].split(","))
            kind: Kind = "movej" if move[1] == "movej" else "movel"
            waypoints.append(
                Waypoint(kind, bool(move[2]), target, float(move[5]), float(move[4]), progress)
            )
            progress = None
        elif row.strip():
            raise ScriptError(f"a path's {row.strip()!r} is not emulated; use moveL and moveJ")
    return Script(int(offset[1]), tuple(waypoints))
