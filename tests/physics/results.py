"""Output of comparisons: a table, a figure, and a file for the guide's page of accuracy."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from bolfi_liquids.models import MODEL_VERSION
from case import Curve, Panel, Row

from bolfi_liquids.drawing import INK, PALETTE, new_figure, plain_log_ticks, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_MARKERS = 60  # a curve of more points is drawn as a line
PANEL_SIZE = (4.6, 3.6)  # inch


def table(rows: Iterable[Row]) -> str:
    """A line for each row, under a line of headings."""
    lines = [("truth", "ours", "error", "tolerance", "", "compared")]
    for row in rows:
        numbers = (f"{value:.4g}" for value in row[1:])
        lines.append((*numbers, "pass" if row.passed else "FAIL", row.quantity))
    return "\n".join("{:>10} {:>10} {:>10} {:>9}  {:4}  {}".format(*line) for line in lines)


def write_figure(path: Path, panels: Sequence[Panel]) -> None:
    """Draw panels side by side into an SVG file: truths as pale lines, ours on top of them."""
    with styled(path.stem):
        figure = new_figure(PANEL_SIZE[0] * len(panels), PANEL_SIZE[1])
        figure.suptitle(path.stem, fontsize=10, color=INK)
        row = figure.subplots(1, len(panels), squeeze=False)[0]
        for axes, panel in zip(row, panels, strict=True):
            _draw(axes, panel)
        figure.savefig(path, metadata={"Date": None})


def write_record(path: Path, kind: str, record: Mapping[str, Any]) -> None:
    """Write what `tests/benchmarks/accuracy_page.py` needs; null stands for what is not finite.

    Args:
        path: Of the file, NAME.json.
        kind: Of the record, one of the page's.
        record: Plain numbers and text, and rows.
    """
    about = {"kind": kind, "name": path.stem, "model": MODEL_VERSION, "created": str(date.today())}
    text = json.dumps(_plain({**about, **record}), indent=1, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def _draw(axes: "Axes", panel: Panel) -> None:
    for curve in panel.curves:
        _draw_curve(axes, curve)
    for which in panel.log:
        plain_log_ticks(axes, which)
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    if any(curve.label for curve in panel.curves):
        axes.legend()


def _draw_curve(axes: "Axes", curve: Curve) -> None:
    colour, label = PALETTE[curve.series % len(PALETTE)], curve.label or None
    if curve.truth:
        style: dict[str, Any] = {"alpha": 0.35, "linewidth": 3.0, "zorder": 1}
    elif np.size(curve.x) > MAX_MARKERS:
        style = {"linewidth": 1.0, "zorder": 2}
    else:
        style = {"marker": "o", "linestyle": "none", "markersize": 3.5, "zorder": 2}
    axes.plot(curve.x, curve.y, color=colour, label=label, **style)


def _plain(value: Any) -> Any:
    if isinstance(value, Row):
        return _plain({**value._asdict(), "passed": value.passed})
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    return None if isinstance(value, float) and not math.isfinite(value) else value
