"""The operator's view while the arm moves."""

from collections.abc import Mapping

import numpy as np
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from ..board import Row, Trouble, Who
from ..safety.guards import OUTCOME_TROUBLE, Reading
from .processes import Status

BAR_WIDTH = 30
LITTLE_MARGIN = 0.2  # of a guard's limit: less margin is shown in yellow
FRESH_SECONDS = 0.5  # [s]; an older sign of life is shown in red
COUNTED_UNITS = {Who.CONTROL: "ticks", Who.RECORDER: "rows"}


def live_table(title: str, status: Status, now: float) -> Table:
    """The view as a table that fits into 80 columns.

    Args:
        title: What is going on, such as "stirring, motion 1 of 30".
        status: Of the session.
        now: Host time [s].
    """
    table = Table.grid(padding=(0, 2))
    table.title = title
    table.add_row("path", _progress(status.rows[Who.CONTROL].value))
    table.add_row("stick", _inclination(status.rows))
    table.add_row("loop", f"at most {1e3 * status.rows[Who.CONTROL].worst:.1f} ms late")
    for who in Who:
        name = "robot" if who is Who.CONTROL else who.label
        table.add_row(name, _alive(who, status.rows[who], now))
    for guard in filter(lambda one: one.unit, status.readings):  # the others are yes or no
        table.add_row(guard.name, _guard(guard))
    if status.stopped is not None:
        table.add_row("stopped", Text(status.stopped.reason, style="bold red"))
    return table


def _progress(share: float) -> Table:
    done = share if np.isfinite(share) else 0.0
    line = Table.grid(padding=(0, 1))
    line.add_row(ProgressBar(total=1.0, completed=done, width=BAR_WIDTH), f"{100 * done:.0f} %")
    return line


def _inclination(rows: Mapping[Who, Row]) -> str:
    return "   ".join(
        f"{plane} {_degrees(rows[who].value)}"
        for plane, who in (("xz", Who.CAMERA_XZ), ("yz", Who.CAMERA_YZ))
    )


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle):+6.2f}°" if np.isfinite(angle) else "not seen"


def _alive(who: Who, row: Row, now: float) -> Text:
    trouble = OUTCOME_TROUBLE[Trouble(int(row.trouble))]
    if trouble:
        return Text(trouble, style="bold red")
    if not row.beat:
        return Text("no sign yet", style="yellow")
    unit = COUNTED_UNITS.get(who, "pictures")
    text = f"{row.rate:6.1f} /s {row.count:9.0f} {unit:<9} {1e3 * row.age(now):5.0f} ms ago"
    return Text(text, style="red" if row.age(now) > FRESH_SECONDS else "green")


def _guard(guard: Reading) -> Text:
    style = "red" if guard.margin <= 0 else "yellow" if guard.margin < LITTLE_MARGIN else "green"
    left = f"{100 * guard.margin:.0f} % left" if guard.margin > 0 else "passed"
    return Text(f"{guard.value:8.3g} of {guard.limit:.3g} {guard.unit}, {left}", style=style)
