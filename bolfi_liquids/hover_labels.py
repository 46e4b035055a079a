"""Data for the page's hover labels, beside a figure's SVG."""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .drawing import to_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINTS_PER_INCH = 72.0
"""The unit of an SVG."""

SIGNIFICANT_DIGITS = 4
"""Of a number in the page's data."""


class Readout(NamedTuple):
    """Values drawn in a figure's axes.

    Attributes:
        axes: Where they are drawn.
        content: `kind` and its values, in the axes' units; see `series`, `marks` and `field`.
    """

    axes: "Axes"
    content: dict[str, Any]


def series(axes: "Axes", x: ArrayLike, lines: dict[str, ArrayLike], **more: Any) -> Readout:
    """Lines over a common x; hovering shows all values at the nearest x.

    Args:
        axes: Where they are drawn.
        x: Shape (n,).
        lines: Label -> values, shape (n,).
        more: Further entries for the page's script.
    """
    rows = [{"label": label, "y": short(values)} for label, values in lines.items()]
    return Readout(axes, {"kind": "series", "at": short(x), "lines": rows, **more})


def marks(axes: "Axes", x: ArrayLike, y: ArrayLike, texts: Sequence[str], **more: Any) -> Readout:
    """Points; hovering shows the text of the nearest one. All of shape (n,)."""
    rows = zip(short(x), short(y), texts, strict=True)
    return Readout(axes, {"kind": "marks", "marks": [list(row) for row in rows], **more})


def field(
    axes: "Axes", x: ArrayLike, y: ArrayLike, values: Mapping[str, NDArray], unit: str
) -> Readout:
    """Values over a grid; hovering shows those at the nearest node.

    Args:
        axes: Where they are drawn.
        x, y: The grid's, shapes (n,) and (m,).
        values: Label -> values, shape (n, m).
        unit: Theirs.
    """
    rows = [{"label": label, "z": [short(r) for r in np.asarray(z)]} for label, z in values.items()]
    content = {"kind": "field", "at": short(x), "up_at": short(y), "fields": rows, "unit": unit}
    return Readout(axes, content)


def lines_of(figure: "Figure") -> list[Readout]:
    """The labelled lines of each axes that share one x array."""
    found = []
    for axes in figure.axes:
        labelled = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
        if labelled:
            x = np.asarray(labelled[0].get_xdata())
            shared = [line for line in labelled if np.array_equal(line.get_xdata(), x)]
            found.append(series(axes, x, {str(k.get_label()): k.get_ydata() for k in shared}))
    return found


def to_chart(figure: "Figure", name: str, readouts: Sequence[Readout]) -> str:
    """A figure as SVG, followed by the data of its hover labels.

    Args:
        figure: Drawn under `styled`.
        name: As of `to_svg`.
        readouts: Of its axes.
    """
    svg = to_svg(figure, name)  # which lays the figure out
    panels = [_frame(figure, readout.axes) | readout.content for readout in readouts]
    return f'{svg}\n<script type="application/json">{script_json(panels)}</script>'


def script_json(value: Any) -> str:
    """JSON that is safe in an HTML script element, whatever texts it holds."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")


def _frame(figure: "Figure", axes: "Axes") -> dict[str, Any]:
    """Where the axes lie in the SVG [pt, y downwards], and their limits, scales and labels."""
    scale = POINTS_PER_INCH / figure.dpi
    height = figure.bbox.height
    box = axes.bbox
    edges = (box.x0, height - box.y1, box.x1, height - box.y0)
    return {
        "box": short([scale * edge for edge in edges]),
        "x": _axis(axes.get_xlim(), axes.get_xscale(), axes.get_xlabel()),
        "y": _axis(axes.get_ylim(), axes.get_yscale(), axes.get_ylabel()),
    }


def _axis(ends: tuple[float, float], scale: str, label: str) -> dict[str, Any]:
    return {"ends": short(ends), "log": scale == "log", "label": label}


def short(values: ArrayLike) -> Any:
    """Nested lists of numbers to a few digits; what is not finite becomes null."""
    array: NDArray[np.float64] = np.asarray(values, np.float64)
    if array.ndim == 0:
        return float(f"{array:.{SIGNIFICANT_DIGITS}g}") if np.isfinite(array) else None
    return [short(part) for part in array]
