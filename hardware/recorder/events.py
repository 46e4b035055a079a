"""events.jsonl: what was commanded and why it ended, in the order in which it happened."""

import errno
import json
import os
from pathlib import Path
from typing import Any

from ..board import host_time

EVENTS = "events.jsonl"
RESERVE = ".reserve"  # given up when the disk is full, so that the reason can still be written
RESERVE_PARTS = 16  # one for each event: what is free, the other writers take at once
RESERVE_BYTES = 16_384  # of each
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # how a disk says that there is no room


class EventLog:
    """Appends lines to a session's events; several processes may write to one file.

    A line is one `write` to a file that was opened for appending: lines of different processes
    do not mix, and a line that was written survives its process.
    """

    def __init__(self, directory: Path, source: str):
        self._directory = directory
        self._source = source
        self._file = os.open(directory / EVENTS, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)

    def write(self, kind: str, **fields: Any) -> None:
        """Append one event with the host's time [s]; `fields` must be JSON.

        Raises:
            OSError: It cannot be written, even after the reserve was given up.
        """
        event = {"host": host_time(), "source": self._source, "kind": kind} | fields
        line = (json.dumps(event) + "\n").encode()
        while True:
            try:
                if os.write(self._file, line) == len(line):
                    return
            except OSError as err:
                if err.errno not in FULL or not _give_up_reserve(self._directory):
                    raise
            else:  # the disk got full within the line: end it, and write it again
                line = b"\n" + line.removeprefix(b"\n")

    def close(self) -> None:
        """Close the file; may be called again."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


def make_reserve(directory: Path) -> None:
    """Set room aside for the last words of a session whose disk gets full.

    Raises:
        OSError: There is no room.
    """
    with (directory / RESERVE).open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, RESERVE_PARTS * RESERVE_BYTES)


def drop_reserve(directory: Path) -> None:
    """Give all of the reserve back, at the end of a session."""
    (directory / RESERVE).unlink(missing_ok=True)


def _give_up_reserve(directory: Path) -> bool:
    """Free one part of the reserve; whether there was one."""
    reserve = directory / RESERVE
    try:
        left = reserve.stat().st_size
        os.truncate(reserve, max(left - RESERVE_BYTES, 0))
    except FileNotFoundError:
        return False
    return left > 0


def read_events(directory: Path) -> list[dict[str, Any]]:
    """All events whose line is whole, oldest first; none where there is no such file."""
    try:
        text = (directory / EVENTS).read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return []
    events = []
    for line in text.splitlines():
        try:
            event = json.loads(line)
        except json.JSONDecodeError:  # cut off by a loss of power
            continue
        if isinstance(event, dict) and "kind" in event:
            events.append(event)
    return events
