"""How a session ended, from its events."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..board import Trouble

CONTROL = "control"  # the source whose word counts
DETAILS = Trouble.BAD_STAMPS.kind, Trouble.WRITE_FAILED.kind
TROUBLES = (*DETAILS, Trouble.SOURCE_LOST.kind, Trouble.SAME_PICTURE.kind, "refused", "failed")
SILENT = "the session ended without a word: it was killed, or power was lost"

Events = Sequence[dict[str, Any]]


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
