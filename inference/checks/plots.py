"""Band, axes and legend of the checks' figures; imports Matplotlib."""

from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np

from ..figures import COLOURS, GREY, INK, bare, check_axes
from . import ranks

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BAND = "#e4e7eb"
SIZE = (5.2, 3.9)  # inch
LEGEND_BELOW: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16), "ncols": 3}


def band(ax: "Axes", n: int, draws: int, level: float = 0.95, diagonal: bool = False) -> np.ndarray:
    """Draw the simultaneous band of n ranks, less the diagonal unless that is drawn, too; returns
    where the band is known, z [draws]."""
    limits = ranks.band(n, draws, level)
    z, last = closed(limits.z, 1.0), float(diagonal)
    line = z if diagonal else np.zeros_like(z)
    lower, upper = (
        closed(edge / n - (0.0 if diagonal else limits.z), last)
        for edge in (limits.lower, limits.upper)
    )
    label = f"{100 * level:g} % band of the whole curve"
    ax.fill_between(z, lower, upper, color=BAND, lw=0, label=label)
    ax.plot(z, line, color=GREY, lw=0.8)
    ax.set_xlim(0.0, 1.0)
    return limits.z


def axes(ax: "Axes | None", size: tuple[float, float] = SIZE) -> "Axes":
    check_axes(ax, "ax")
    return plt.subplots(figsize=size, layout="constrained")[1] if ax is None else ax


def colour(j: int) -> str:
    return COLOURS[j % len(COLOURS)]


def closed(values: np.ndarray, last: float) -> np.ndarray:
    """A curve that starts at 0 and ends at `last`."""
    return np.concatenate([[0.0], values, [last]])


def finish(ax: "Axes", n: int, **place: Any) -> "Axes":
    ax.set_title(f"{n} replicates", loc="right", color=GREY)
    ax.legend(**place, frameon=False, fontsize="small", labelcolor=INK)
    return bare(ax)
