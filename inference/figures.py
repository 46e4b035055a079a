"""How all figures of the engine look. Matplotlib is imported by whoever asks for one."""

import numpy as np
from matplotlib.axes import Axes

from .arguments import require

INK, GREY = "#1f2933", "#8a94a0"
COLOURS = ("#2463a6", "#d1591a", "#2d8659", "#8a4fa3", "#b8860b", "#5b6770", "#c2185b", "#00838f")


def check_axes(axes: object, name: str = "axes") -> None:
    """Raise ValueError unless these are axes of Matplotlib, one or many, or None."""
    given = [] if axes is None else np.atleast_1d(np.asarray(axes, object)).ravel()
    fits = all(isinstance(one, Axes) for one in given)
    require(fits, name, "be of Matplotlib, as of plt.subplots()", axes)


def bare(ax: Axes) -> Axes:
    """Axes with two spines, quiet ones."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color(GREY)
    ax.tick_params(colors=INK, labelsize="small")
    return ax
