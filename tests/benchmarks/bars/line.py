"""One line of the table: a figure beside its bar."""

from typing import NamedTuple


class Line(NamedTuple):
    """A figure and what it is held to.

    Attributes:
        what: Is measured, with its unit.
        ours: The figure; NaN where a simulation failed, which meets no bar.
        bar: The most that it may be (the least, where `least`); None: for information.
        least: Whether the bar is a lower one.
    """

    what: str
    ours: float
    bar: float | None = None
    least: bool = False

    @property
    def met(self) -> bool | None:
        """Whether the figure meets its bar; None where there is none."""
        if self.bar is None:
            return None
        return self.ours >= self.bar if self.least else self.ours <= self.bar


HEAD = f"{'what':62} {'ours':>8} {'bar':>8}"
VERDICT = {True: "met", False: "NOT MET", None: ""}


def row(line: Line) -> str:
    """A row below `HEAD`."""
    sign = ">=" if line.least else "<="
    bar = "" if line.bar is None else f"{sign} {line.bar:g}"
    return f"{line.what:62} {line.ours:8.3f} {bar:>8} {VERDICT[line.met]}".rstrip()
