"""The search: what each simulation tried, in turn, and how near it came."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..drawing import (
    BLUE,
    GREY,
    Panels,
    hover_points,
    panels,
    plain_log_ticks,
)
from ..wording import with_unit
from .posterior_figure import AXIS_LABELS, LOGARITHMIC_PARAMETERS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset, DataTree

    from ..drawing import Canvas

POSTERIOR_INTERVAL = 0.05, 0.95
"""Quantiles of the posterior between which the panels are shaded."""


def draw_search(tree: "DataTree", axes: "Canvas" = None) -> Panels:
    """Discrepancy of each simulation in turn with the least so far, and below it the parameters
    that it tried, before the posterior; the start design is hollow.

    Args:
        tree: posterior.nc.
        axes: Where to draw, see `drawing.panels`; one for the discrepancy and one for each
            parameter.
    """
    from matplotlib.ticker import MaxNLocator

    simulations = tree["simulations"].to_dataset()
    # effects that were added to the posterior later were not searched for
    names = [str(name) for name in tree["posterior"].data_vars if name in simulations]
    discrepancy = np.degrees(np.degrees(simulations["discrepancy"].to_numpy()))
    iteration = np.arange(1, len(discrepancy) + 1)
    start = iteration <= int(tree.attrs["initial"])
    texts = _texts(names, simulations, discrepancy)
    size, ratios = (6.4, 2.6 + 1.5 * len(names)), [1.5] + [1.0] * len(names)
    drawn = panels(axes, (1 + len(names), 1), size, sharex=True, height_ratios=ratios)
    first, *others = drawn.grid[:, 0]
    least = np.fmin.accumulate(discrepancy)
    first.step(iteration, least, where="post", color=GREY, linewidth=1.0, label="least so far")
    _dots(first, iteration, discrepancy, start, texts)
    plain_log_ticks(first, "y")
    first.set_ylabel("discrepancy [deg² s]")
    for axis, name in zip(others, names, strict=True):
        low, high = np.quantile(tree["posterior"][name].to_numpy(), POSTERIOR_INTERVAL)
        axis.axhspan(low, high, color=BLUE, alpha=0.15, linewidth=0, label="posterior, 90 %")
        _dots(axis, iteration, simulations[name].to_numpy(), start, texts)
        axis.set_ylabel(AXIS_LABELS.get(name, name))
        if name in LOGARITHMIC_PARAMETERS:
            plain_log_ticks(axis, "y")
    others[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    others[-1].set_xlabel("simulation")
    handles, labels = first.get_legend_handles_labels()
    more, more_labels = others[0].get_legend_handles_labels()
    drawn.legend([*handles, more[0]], [*labels, more_labels[0]], ncols=4)
    return drawn


def _texts(names: list[str], simulations: "Dataset", discrepancy: NDArray) -> list[str]:
    """Parameters and discrepancy of each simulation."""
    tried = [simulations[name].to_numpy() for name in names]
    return [
        f"simulation {at + 1}: "
        + ", ".join(
            f"{name} {with_unit(name, values[at])}"
            for name, values in zip(names, tried, strict=True)
        )
        + (f"; discrepancy {off:.3g} deg² s" if np.isfinite(off) else "; failed")
        for at, off in enumerate(discrepancy)
    ]


def _dots(
    axes: "Axes", iteration: NDArray, values: NDArray, start: NDArray, texts: list[str]
) -> None:
    for chosen, face, label in (
        (start, "white", "start design"),
        (~start, BLUE, "engine's choice"),
    ):
        axes.plot(
            iteration[chosen],
            values[chosen],
            "o",
            markersize=5,
            color=BLUE,
            markerfacecolor=face,
            label=label,
        )
    hover_points(axes, iteration, values, texts)
