"""events.jsonl: what was commanded and why it ended, in the order in which it happened."""

import errno
import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from ..board import Trouble, host_time

EVENTS = "events.jsonl"
RESERVE = ".reserve"  # given up when the disk is full, so that the reason can still be written
RESERVE_PARTS = 16  # one for each event: what is free, the other writers take at once
RESERVE_BYTES = 16_384  # of each
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # how a disk says that there is no room
CONTROL = "control"  # the source whose word counts
DETAILS = Trouble.BAD_STAMPS.kind, Trouble.WRITE_FAILED.kind
TROUBLES = (*DETAILS, Trouble.SOURCE_LOST.kind, Trouble.SAME_PICTURE.kind, "refused", "failed")
SILENT = "the session ended without a word: it was killed, or power was lost"

Events = Sequence[dict[str, Any]]


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


class Disk:
    """Carries out writes until one fails; tells the reason once, and writes no more.

    Attributes:
        trouble: What to complain of on the board.
        slowest: Longest time that a write has taken [s].
    """

    def __init__(self, log: EventLog):
        self.trouble = Trouble.NONE
        self.slowest = 0.0
        self._log = log

    def write[T](self, name: str, act: Callable[[], T]) -> T | None:
        """Write to the file `name` by `act`; returns its result, None once a write has failed."""
        if self.trouble is Trouble.WRITE_FAILED:
            return None
        start = host_time()
        try:
            return act()
        except OSError as err:
            self.trouble = Trouble.WRITE_FAILED
            cure = " (make room)" if err.errno in FULL else ""
            reason = f"{name}: {err.strerror or err}{cure}"
            self.tell(self.trouble.kind, file=name, reason=reason)
        finally:
            self.slowest = max(self.slowest, host_time() - start)
        return None

    def tell(self, kind: str, **fields: Any) -> None:
        """Write an event, if it can be written at all; the board tells of trouble besides."""
        with suppress(OSError):
            self._log.write(kind, **fields)


@contextmanager
def writing(directory: Path, source: str) -> Iterator[Disk]:
    """The disk and the events of a process; an error that ends it leaves its reason there."""
    with closing(EventLog(directory, source)) as log:
        disk = Disk(log)
        try:
            yield disk
        except Exception as err:
            disk.tell("failed", reason=f"{type(err).__name__}: {err}")
            raise


class Outcome(NamedTuple):
    """Status ("complete" or "aborted") and the reason for it."""

    status: str
    reason: str


def outcome(events: Events, cut: str = "") -> Outcome:
    """Complete only if control has said that the plan was carried out, and nothing is cut off.

    Args:
        events: Of the session, oldest first.
        cut: Why the recorded stir ends early; empty where it does not.
    """
    told = [event for event in events if event["kind"] == "stopped"]
    told += [event for event in events if event["kind"] in TROUBLES]
    if told:
        return Outcome("aborted", detailed(_reason(told[0]), told[1:]))
    if not _carried_out(events):
        return Outcome("aborted", f"{SILENT} ({cut})" if cut else SILENT)
    return Outcome("aborted", cut) if cut else Outcome("complete", "the plan was carried out")


def detailed(reason: str, events: Events) -> str:
    """Why a session ended, with what control does not know.

    Control tells only that stamps are bad or that something is not written; the process that has
    complained of it says from which frame on, or which file and why.
    """
    known = (event for event in events if event["kind"] in DETAILS)
    return "; ".join([reason, *[_reason(event) for event in known][:1]])


def _carried_out(events: Events) -> bool:
    """Whether control began a stir, was done with all that it began, and left."""
    said = [event for event in events if event.get("source") == CONTROL]
    began = [event for event in said if event["kind"] == "began"]
    done = {event.get("number") for event in said if event["kind"] == "done"}
    stirred = any(event.get("stirring") for event in began)
    left = any(event["kind"] == "left" for event in said)
    return stirred and left and all(event.get("number") in done for event in began)


def _reason(event: dict[str, Any]) -> str:
    reason = str(event.get("reason") or "no reason given")
    if event["kind"] == "stopped":
        return reason
    return f"{event.get('source')}: {event['kind'].replace('_', ' ')}: {reason}"
