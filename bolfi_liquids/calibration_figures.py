"""Figures of a calibration: the fit in time, and the discrepancy by iteration."""

from typing import TYPE_CHECKING

import numpy as np

from .drawing import BLUE, GREY, INK, LIGHT, ORANGE, new_figure, plain_log_ticks, styled, to_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset, DataTree


def inclination_figure(tree: "DataTree") -> str:
    """Inclination against time: recorded, closest hypothesis and posterior prediction.

    One row for each recording, one column for each plane.
    """
    recorded = tree["recorded"].to_dataset()
    members = np.unique(recorded["recording"])
    with styled():
        figure = new_figure(8.6, 2.6 * len(members) + 0.4)
        grid = figure.subplots(len(members), 2, sharex="row", sharey=True, squeeze=False)
        for row, member in zip(grid, members, strict=True):
            frames = np.flatnonzero(recorded["recording"].to_numpy() == member)
            for axes, plane in zip(row, recorded["plane"].to_numpy(), strict=True):
                part = {
                    name: tree[name].to_dataset().sel(plane=plane).isel(frame=frames)
                    for name in ("recorded", "closest", "posterior_predictive")
                }
                _draw_inclination(axes, part)
                axes.set_title(f"{plane} plane", loc="left")
            row[0].set_ylabel("inclination [deg]")
        for axes in grid[-1]:
            axes.set_xlabel("time [s]")
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
        return to_svg(figure, "inclination")


def _draw_inclination(axes: "Axes", part: dict[str, "Dataset"]) -> None:
    time = part["recorded"]["time"].to_numpy()
    degrees = {name: np.degrees(data["inclination"].to_numpy()) for name, data in part.items()}
    predicted = degrees["posterior_predictive"].reshape(-1, len(time))
    axes.fill_between(
        time,
        predicted.min(axis=0),
        predicted.max(axis=0),
        color=BLUE,
        alpha=0.25,
        linewidth=0,
        label=f"range of {len(predicted)} posterior predictions",
    )
    axes.plot(time, degrees["closest"], color=ORANGE, linewidth=1.1, label="closest hypothesis")
    axes.plot(time, degrees["recorded"], color=INK, linewidth=0.9, label="recorded")
    axes.axhline(0.0, color=LIGHT, linewidth=0.8, zorder=0)


def discrepancy_figure(tree: "DataTree") -> str:
    """Discrepancy of each simulation in turn, and the least so far; start design hollow."""
    from matplotlib.ticker import MaxNLocator

    discrepancy = np.degrees(np.degrees(tree["simulations"]["discrepancy"].to_numpy()))
    iteration = np.arange(1, len(discrepancy) + 1)
    start = iteration <= int(tree.attrs["initial"])
    with styled():
        figure = new_figure(6.4, 2.8)
        axes = figure.subplots()
        least = np.fmin.accumulate(discrepancy)
        axes.step(iteration, least, where="post", color=GREY, linewidth=1.0, label="least so far")
        for chosen, face, label in (
            (start, "white", "start design"),
            (~start, BLUE, "engine's choice"),
        ):
            axes.plot(
                iteration[chosen],
                discrepancy[chosen],
                "o",
                markersize=5,
                color=BLUE,
                markerfacecolor=face,
                label=label,
            )
        plain_log_ticks(axes, "y")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("simulation")
        axes.set_ylabel("discrepancy [deg² s]")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
        return to_svg(figure, "discrepancy")
