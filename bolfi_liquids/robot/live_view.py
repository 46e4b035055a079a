"""The live view of a session, in a terminal."""

import logging
from typing import TYPE_CHECKING

from rich.console import Console, Group
from rich.live import Live

if TYPE_CHECKING:
    from ..hardware import Session

logger = logging.getLogger(__name__)

REFRESH_RATE = 5.0  # per second


class SessionView:
    """Shows how a session stands while something waits for it; a context manager.

    Args:
        title: What is going on.
        shown: Whether to show it; never where stderr is no terminal.
    """

    def __init__(self, title: str, *, shown: bool = True):
        self.title = title
        self.motions: int | None = None  # of the plan, where it is known
        self._note = ""
        self._warned: set[str] = set()
        self._console = Console(stderr=True, quiet=not shown)
        shown = shown and self._console.is_terminal
        self._live = Live(console=self._console, auto_refresh=False) if shown else None

    def __enter__(self) -> "SessionView":
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def until_done(self, session: "Session", number: int) -> None:
        """Wait until a path is done.

        Raises:
            SessionStopped: The arm was stopped.
        """
        while not session.wait(number, timeout=1.0 / REFRESH_RATE):
            self.show(session)
        self.show(session)

    def say(self, note: str) -> None:
        """Keep a line beside the view; where there is no view, print it once."""
        if self._live is None and note != self._note:
            self._console.print(note, highlight=False, soft_wrap=True)
        self._note = note

    def warn(self, notice: str) -> None:
        """Log a line, once, whether anything is shown or not."""
        if notice not in self._warned:
            self._warned.add(notice)
            logger.warning(notice)

    def show(self, session: "Session") -> None:
        """Draw the session as it is now."""
        if self._live is None:
            return
        from ..hardware.board import host_time
        from ..hardware.session.live import live_table

        status = session.status()
        title = self.title
        if self.motions is not None:
            title += f", motion {min(len(status.done) + 1, self.motions)} of {self.motions}"
        shown = live_table(title, status, host_time())
        self._live.update(Group(shown, self._note), refresh=True)
