"""The chosen pour: where it lies among the actions, and what it spills."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..drawing import (
    BLUE,
    INK,
    ORANGE,
    new_figure,
    styled,
)
from ..pouring.spillage import ACTION, RISK
from .hover import Readout, field, to_chart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import QuadContourSet
    from matplotlib.figure import SubFigure
    from matplotlib.patches import Patch
    from xarray import Dataset, DataTree

LEVELS = (0, 1, 2, 5, 10, 20, 40, 70, 100)  # percent: it matters where little is spilled
BAD = 0.9  # quantile of the draws, of which a map is shown beside that of the expectation
SURE, RESAMPLED = 0.95, 200  # of which differences are sure, and by how many bootstrap samples
FEW = 8  # draws, of which fewer tell too little
CHOICES = {"chosen": (BLUE, "o", "chosen pour"), "plug_in": (ORANGE, "s", "best at θ* alone")}


def pour_figure(tree: "DataTree") -> str:
    """Spillage over the actions, as expected and in a bad case (above), and of the two choices over
    outcomes (below)."""
    with styled():
        figure = new_figure(8.6, 6.4)
        upper, lower = figure.subfigures(2, 1, height_ratios=(5, 4))
        maps = upper.subplots(1, 2, sharey=True)
        readout = _draw_maps(upper, maps, tree)
        _draw_outcomes(lower.subplots(), tree)
        return to_chart(figure, "pour", readout)


def _draw_maps(figure: "SubFigure", panels: NDArray, tree: "DataTree") -> list[Readout]:
    """The risk on which the first round chose, with the actions that are not surely worse than the
    chosen one, and a quantile over the draws."""
    actions = tree["actions"].to_dataset()
    x = np.degrees(actions["angular_velocity"].to_numpy())
    y = 100.0 * actions["distance"].to_numpy()
    bad = np.quantile(actions["spilled"].to_numpy(), BAD, axis=0)
    percent = {
        "expected" if tree.attrs["risk"] == "mean" else "CVaR": 100.0 * actions["risk"].to_numpy(),
        f"in {100 * BAD:.0f} % of the draws at most": 100.0 * bad,
    }
    shades = [
        _draw_map(axes, x, y, values) for axes, values in zip(panels, percent.values(), strict=True)
    ]
    for axes, title in zip(panels, percent, strict=True):
        axes.set_title(title, loc="left")
        axes.set_xlabel("angular velocity [deg/s]")
        _mark_choices(axes, tree)
    panels[0].set_ylabel("distance from lip to receiver's axis [cm]")
    figure.colorbar(shades[0], ax=list(panels), label="spilled [%]")
    handles, labels = panels[0].get_legend_handles_labels()
    alike = not_surely_worse(
        actions["spilled"].to_numpy(), tree.attrs["risk"], _place(actions, tree["chosen"].attrs)
    )
    if alike.any():
        handles.append(_dot(panels[0], x, y, alike))
        labels.append("not surely worse than the chosen")
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return [field(axes, x, y, percent, "%") for axes in panels]


def _draw_map(axes: "Axes", x: NDArray, y: NDArray, percent: NDArray) -> "QuadContourSet":
    shades = axes.contourf(x, y, percent.T, levels=LEVELS, cmap="Greys", alpha=0.8)
    lines = axes.contour(x, y, percent.T, levels=LEVELS[1:4], colors=INK, linewidths=0.6)
    axes.clabel(lines, fmt="%g %%", fontsize=7.5)
    return shades


def _dot(axes: "Axes", x: NDArray, y: NDArray, where: NDArray) -> "Patch":
    """Dots over actions, bool (W, D); what stands for them in a legend."""
    from matplotlib.patches import Patch

    levels = (0.5, 1.5)
    axes.contourf(x, y, where.T.astype(float), levels=levels, colors="none", hatches=["...."])
    return Patch(facecolor="none", edgecolor=INK, hatch="....", lw=0.0)


def _place(actions: "Dataset", chosen: dict) -> tuple[int, int]:
    """Row and column of an action."""
    row, column = (
        int(np.argmin(np.abs(actions[name].to_numpy() - chosen[name]))) for name in ACTION
    )
    return row, column


def not_surely_worse(
    spilled: NDArray, risk: str, chosen: tuple[int, int], seed: int = 0
) -> NDArray[np.bool_]:
    """Actions of which these draws do not tell, at `SURE`, that they are worse than the chosen.

    The difference of two actions is paired by draw, so what all actions spill of a liquid alike
    counts for nothing; its interval is a bootstrap over draws.

    Args:
        spilled: Of each draw, shape (draws, W, D).
        risk: Which measure of `spillage.RISK` is compared.
        chosen: Row and column of the chosen action.
        seed: Of the bootstrap.

    Returns:
        Shape (W, D); none of them where there are fewer than `FEW` draws.
    """
    if len(spilled) < FEW:
        return np.zeros(spilled.shape[1:], bool)
    again = np.random.default_rng(seed).integers(len(spilled), size=(RESAMPLED, len(spilled)))
    risks = np.stack([RISK[risk](spilled[draws]) for draws in again])
    return np.quantile(risks - risks[:, *chosen][:, None, None], 1.0 - SURE, axis=0) <= 0.0


def _mark_choices(axes: "Axes", tree: "DataTree") -> None:
    for name, (colour, marker, label) in CHOICES.items():
        action = tree[name].attrs
        at = np.degrees(action["angular_velocity"]), 100.0 * action["distance"]
        face = colour if name == "chosen" else "none"  # hollow: both stay visible in one place
        axes.plot(
            *at,
            marker,
            color=colour,
            markerfacecolor=face,
            markersize=8 if name == "chosen" else 12,
            label=label,
            clip_on=False,
            zorder=5,
        )


def _draw_outcomes(axes: "Axes", tree: "DataTree") -> None:
    for at, (name, (colour, marker, _)) in enumerate(CHOICES.items()):
        percent = 100.0 * tree[name]["spilled"].to_numpy()
        spread = np.linspace(-0.18, 0.18, len(percent))
        axes.plot(percent, at + spread, ".", color=colour, alpha=0.45, markersize=5)
        low, high = np.quantile(percent, (0.05, 0.95))
        axes.plot([low, high], [at + 0.3] * 2, color=colour, linewidth=2.0)
        axes.plot(percent.mean(), at + 0.3, marker, color=colour, markersize=7)
    axes.set_yticks(range(len(CHOICES)), [label for _, _, label in CHOICES.values()])
    axes.set_ylim(len(CHOICES) - 0.4, -0.5)
    axes.set_xlim(left=0)
    axes.set_xlabel("spilled [%]")
