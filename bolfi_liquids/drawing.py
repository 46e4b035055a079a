"""Figures of one style: SVG within a page, which needs no other file, or files of their own."""

import io
import re
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .files import write_whole

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    Canvas = Axes | ArrayLike | Figure | None

INK, GREY, LIGHT = "#1f2933", "#8a94a0", "#e4e7eb"
BLUE, ORANGE = "#2463a6", "#d1591a"
PALETTE = (BLUE, ORANGE, "#2d8659", "#8a4fa3", "#b8860b", "#5b6770")
"""Distinguishable with red-green colour blindness."""
_STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 9.0,
    "svg.fonttype": "none",  # text stays text: it can be searched, read aloud and copied
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9.0,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
}
RESOLUTION = 150  # dots per inch of a PNG
HOVER_STRIPS = 60  # parts of an axis with a text each
HOVER_SIZE = 9.0  # points, of the place around a mark in which its text is shown
HOVER = "hover: "
"""Begins the ids of SVG groups whose remaining text a browser shows under the pointer."""

_HOVER_GROUP = re.compile(rf"<g id=([\"']){HOVER}(.*?)\1>")
_OUTSIDE = re.compile(r"<metadata>.*?</metadata>|\sxmlns(?::\w+)?=\"[^\"]*\"", re.DOTALL)


def styled(name: str = "") -> AbstractContextManager[None]:
    """The report's style, inside `with`; `name` sets the ids of an SVG written there."""
    import matplotlib

    return matplotlib.rc_context({**_STYLE, "svg.hashsalt": name})


def new_figure(width: float, height: float) -> "Figure":
    """An empty figure of this size [inch], outside pyplot's global state."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


class Panels(NamedTuple):
    """The axes of a plot.

    Attributes:
        figure: Whose axes they are.
        grid: The axes, shape (rows, columns).
        own: Whether the figure was made for the plot alone.
    """

    figure: "Figure"
    grid: np.ndarray
    own: bool

    def legend(self, handles: list, labels: list[str], ncols: int = 3) -> None:
        """Above the plot, or within the first axes of a caller's figure."""
        if self.own:
            self.figure.legend(handles, labels, loc="outside upper center", ncols=ncols)
        else:
            self.grid.flat[0].legend(handles, labels)


def shown(draw: "Callable[[Canvas], Panels]", axes: "Canvas") -> np.ndarray:
    """The axes of a plot, drawn in those that are given, or in a figure that a notebook shows.

    Args:
        draw: Draws the plot, see `panels`.
        axes: None makes a figure of pyplot's.
    """
    # before the style: the first import sets what a notebook needs, and the style's end unsets it
    import matplotlib.pyplot as plt

    canvas = plt.figure(layout="constrained") if axes is None else axes
    with styled():
        return draw(canvas).grid


def panels(
    axes: "Canvas", shape: tuple[int, int], size: tuple[float, float], **options: Any
) -> Panels:
    """The axes that a caller gives, or those of an empty figure.

    Args:
        axes: One or several `matplotlib.axes.Axes`, row by row, or an empty figure to make them
            in; None makes a figure outside pyplot's global state.
        shape: Rows and columns of axes that the plot needs.
        size: Width and height of the figure [inch], unless the axes are given.
        **options: Of `Figure.subplots`, unless the axes are given.

    Raises:
        ValueError: The plot needs another number of axes than are given.
    """
    from matplotlib.figure import Figure

    if axes is None or isinstance(axes, Figure):
        figure = new_figure(*size) if axes is None else axes
        figure.set_size_inches(size)
        return Panels(figure, figure.subplots(*shape, squeeze=False, **options), True)
    given = np.atleast_1d(np.asarray(axes, dtype=object))
    if given.size != shape[0] * shape[1]:
        raise ValueError(
            f"this plot needs {shape[0]} x {shape[1]} axes, got {given.size}; "
            f"make them with plt.subplots{shape}"
        )
    return Panels(given.flat[0].figure, given.reshape(shape), False)


def hover(artist: "Artist", text: str) -> None:
    """Show a text while the pointer is over an artist, where `to_svg` writes its figure."""
    artist.set_gid(HOVER + text)
    artist.set_in_layout(False)  # which would measure hundreds of them again and again


def hover_points(axes: "Axes", x: "ArrayLike", y: "ArrayLike", texts: Sequence[str]) -> None:
    """Show texts under the pointer near points, all of shape (n,); none where one is not finite."""
    for at, up, text in zip(np.asarray(x), np.asarray(y), texts, strict=True):
        if np.isfinite(at) and np.isfinite(up):
            (unseen,) = axes.plot(at, up, "o", color=INK, markersize=HOVER_SIZE, alpha=0.0)
            hover(unseen, text)


def hover_strips(axes: "Axes", x: "ArrayLike", text_at: Callable[[int], str]) -> None:
    """Show texts under the pointer along values of x, shape (n,), ascending.

    Args:
        axes: Over whose whole height they are shown.
        x: Where something is drawn.
        text_at: The text of an index of x; that in the middle of each strip is taken.
    """
    values = np.asarray(x, float)
    for part in np.array_split(np.arange(len(values)), min(HOVER_STRIPS, len(values))):
        start, stop = (float(values[at]) for at in (part[0], min(part[-1] + 1, len(values) - 1)))
        hover(axes.axvspan(start, stop, alpha=0.0), text_at(part[len(part) // 2]))


def to_svg(figure: "Figure", name: str) -> str:
    """A figure as an SVG element for an HTML page, with what `hover` shows as SVG titles.

    Args:
        figure: Drawn under `styled`.
        name: Different for each figure of a page, as it makes the element's ids different.
    """
    with styled(name):
        text = io.StringIO()
        figure.savefig(text, format="svg", transparent=True)
    svg = text.getvalue()
    # HTML needs neither the XML prologue nor namespaces, and readers no links to standards
    whole = _OUTSIDE.sub("", svg[svg.index("<svg") :]).strip()
    # what is not painted would not meet the pointer
    return _HOVER_GROUP.sub(r'<g pointer-events="all"><title>\2</title>', whole)


def write_figure(figure: "Figure", out: Path, name: str) -> None:
    """NAME.png and NAME.svg in `out`."""
    with styled(name):
        for kind in ("png", "svg"):
            write_whole(
                out / f"{name}.{kind}",
                lambda at, kind=kind: figure.savefig(at, format=kind, dpi=RESOLUTION),
            )


def plain_log_ticks(axes: "Axes", which: str) -> None:
    """A logarithmic axis labelled 0.01, 0.1, 1 instead of powers; `which` is "x" or "y"."""
    from matplotlib.ticker import FuncFormatter, LogFormatter

    getattr(axes, f"set_{which}scale")("log")
    axis = getattr(axes, f"{which}axis")
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    # between the decades only where fewer than two are in view
    axis.set_minor_formatter(LogFormatter(minor_thresholds=(1.5, 0.5)))
