"""A validation case's plot: truths as pale lines, what was simulated on top of them."""

import io
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..drawing import (
    INK,
    PALETTE,
    new_figure,
    plain_log_ticks,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_MARKERS = 60  # a curve of more points is drawn as a line
PANEL_SIZE = (4.6, 3.6)  # inch


def physics_figure(record: Mapping[str, Any]) -> str:
    """An SVG file of the panels of a case's record, as `physics_records` keeps them."""
    panels = record["panels"]
    with styled(record["name"]):
        figure = new_figure(PANEL_SIZE[0] * len(panels), PANEL_SIZE[1])
        figure.suptitle(record["title"], fontsize=10, color=INK)
        grid = figure.subplots(1, len(panels), squeeze=False)
        for axes, panel in zip(grid[0], panels, strict=True):
            _draw(axes, panel)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def _draw(axes: "Axes", panel: Mapping[str, Any]) -> None:
    for curve in panel["curves"]:
        colour = PALETTE[curve["series"] % len(PALETTE)]
        x, y = (np.array(curve[key], float) for key in ("x", "y"))  # null becomes a gap
        label = curve["label"] or None
        if curve["truth"]:
            axes.plot(x, y, color=colour, alpha=0.35, linewidth=3.0, label=label, zorder=1)
        elif len(x) > MAX_MARKERS:
            axes.plot(x, y, color=colour, linewidth=1.0, label=label, zorder=2)
        else:
            axes.plot(x, y, "o", color=colour, markersize=3.5, label=label, zorder=2)
    for which in panel["log"]:
        plain_log_ticks(axes, which)
    axes.set_xlabel(panel["x_label"])
    axes.set_ylabel(panel["y_label"])
    if any(curve["label"] for curve in panel["curves"]):
        axes.legend()
