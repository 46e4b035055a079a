"""Results as text, and as HTML in a notebook."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from html import escape

Rows = Sequence[tuple[str, str]]
"""(what, its value), top to bottom."""


class Displayed(ABC):
    """Shown as a title, the name of its class, and a row for each value."""

    @abstractmethod
    def _shown(self) -> Rows:
        """The rows."""

    def __repr__(self) -> str:
        rows = (f"{what}: {value}" for what, value in self._shown())
        return "\n  ".join([type(self).__name__, *rows])

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self._shown())


def html_table(title: str, rows: Iterable[tuple[str, object]]) -> str:
    """A table of two columns for a notebook; its texts are escaped."""
    cells = "".join(
        f"<tr><th style='text-align:left'>{escape(what)}</th>"
        f"<td style='text-align:left'>{escape(str(value))}</td></tr>"
        for what, value in rows
    )
    return f"<table><caption>{escape(title)}</caption>{cells}</table>"
