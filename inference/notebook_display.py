"""Results as text, and as HTML in a notebook."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
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
        cells = "".join(
            f"<tr><th style='text-align:left'>{escape(what)}</th>"
            f"<td style='text-align:left'>{escape(value)}</td></tr>"
            for what, value in self._shown()
        )
        return f"<table><caption>{escape(type(self).__name__)}</caption>{cells}</table>"
