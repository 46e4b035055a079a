"""Rows of names and values as text, and as HTML in a notebook."""

from collections.abc import Sequence
from html import escape

Rows = Sequence[tuple[str, str]]
"""(what, its value), top to bottom."""


def as_text(title: str, rows: Rows) -> str:
    """The title, and below it a line for each row."""
    return "\n  ".join([title, *(f"{what}: {value}" for what, value in rows)])


def as_html(title: str, rows: Rows) -> str:
    """A table under its title."""
    cells = "".join(
        f"<tr><th style='text-align:left'>{escape(what)}</th>"
        f"<td style='text-align:left'>{escape(value)}</td></tr>"
        for what, value in rows
    )
    return f"<table><caption>{escape(title)}</caption>{cells}</table>"
