"""The chosen pour: where it lies among the actions, and what it spills."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..drawing import new_figure, styled
from ..hover_labels import Readout, field, to_chart
from ..pouring.figures import (
    BAD_CASE,
    action_axes,
    dot_actions,
    draw_map,
    draw_outcomes,
    mark_choices,
    not_surely_worse,
    place_of,
    risk_label,
)

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure
    from xarray import DataTree


def pour_figure(tree: "DataTree") -> str:
    """Spillage over the actions, as expected and in a bad case (above), and of the two choices over
    outcomes (below)."""
    with styled():
        figure = new_figure(8.6, 6.4)
        upper, lower = figure.subfigures(2, 1, height_ratios=(5, 4))
        maps = upper.subplots(1, 2, sharey=True)
        readout = _draw_maps(upper, maps, tree)
        draw_outcomes(lower.subplots(), tree)
        return to_chart(figure, "pour", readout)


def _draw_maps(figure: "SubFigure", panels: NDArray, tree: "DataTree") -> list[Readout]:
    """The risk by which the pour was chosen, with the actions that are not surely worse, and a
    quantile over the draws."""
    actions = tree["actions"].to_dataset()
    x, y = action_axes(tree)
    bad = np.quantile(actions["spilled"].to_numpy(), BAD_CASE, axis=0)
    percent = {
        risk_label(tree): 100.0 * actions["risk"].to_numpy(),
        f"in {100 * BAD_CASE:.0f} % of the draws at most": 100.0 * bad,
    }
    shades = [
        draw_map(axes, x, y, values) for axes, values in zip(panels, percent.values(), strict=True)
    ]
    for axes, title in zip(panels, percent, strict=True):
        axes.set_title(title, loc="left")
        axes.set_xlabel("angular velocity [deg/s]")
        mark_choices(axes, tree)
    panels[0].set_ylabel("distance from lip to receiver's axis [cm]")
    figure.colorbar(shades[0], ax=list(panels), label="spilled [%]")
    handles, labels = panels[0].get_legend_handles_labels()
    alike = not_surely_worse(
        actions["spilled"].to_numpy(), tree.attrs["risk"], place_of(actions, tree["chosen"].attrs)
    )
    if alike.any():
        handles.append(dot_actions(panels[0], x, y, alike))
        labels.append("not surely worse than the chosen")
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return [field(axes, x, y, percent, "%") for axes in panels]
