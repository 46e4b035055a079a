"""The chosen pour: where it lies among the actions, and what it spills."""

from typing import TYPE_CHECKING

import numpy as np

from .drawing import BLUE, INK, ORANGE, new_figure, styled, to_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from xarray import DataTree

LEVELS = (0, 1, 2, 5, 10, 20, 40, 70, 100)  # percent: it matters where little is spilled
CHOICES = {"chosen": (BLUE, "o", "chosen pour"), "plug_in": (ORANGE, "s", "best at θ* alone")}


def pour_figure(tree: "DataTree") -> str:
    """Spillage over the actions (left), and of the two choices over outcomes (right)."""
    with styled():
        figure = new_figure(8.6, 3.4)
        left, right = figure.subplots(1, 2, gridspec_kw={"width_ratios": (3, 2)})
        _draw_actions(figure, left, tree)
        _draw_outcomes(right, tree)
        return to_svg(figure, "pour")


def _draw_actions(figure: "Figure", axes: "Axes", tree: "DataTree") -> None:
    actions = tree["actions"]
    x = np.degrees(actions["angular_velocity"].to_numpy())
    y = 100.0 * actions["distance"].to_numpy()
    percent = 100.0 * actions["risk"].to_numpy().T
    shades = axes.contourf(x, y, percent, levels=LEVELS, cmap="Greys", alpha=0.8)
    figure.colorbar(shades, ax=axes, label="expected spillage [%]")
    lines = axes.contour(x, y, percent, levels=LEVELS[1:4], colors=INK, linewidths=0.6)
    axes.clabel(lines, fmt="%g %%", fontsize=7.5)
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
    axes.set_xlabel("angular velocity [deg/s]")
    axes.set_ylabel("distance from lip to receiver's axis [cm]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def _draw_outcomes(axes: "Axes", tree: "DataTree") -> None:
    for at, (name, (colour, marker, _)) in enumerate(CHOICES.items()):
        percent = 100.0 * tree[name]["spilled"].to_numpy()
        spread = np.linspace(-0.18, 0.18, len(percent))
        axes.plot(at + spread, percent, ".", color=colour, alpha=0.45, markersize=5)
        low, high = np.quantile(percent, (0.05, 0.95))
        axes.plot([at + 0.3] * 2, [low, high], color=colour, linewidth=2.0)
        axes.plot(at + 0.3, percent.mean(), marker, color=colour, markersize=7)
    axes.set_xticks(range(len(CHOICES)), [label for _, _, label in CHOICES.values()])
    axes.set_xlim(-0.5, len(CHOICES) - 0.4)
    axes.set_ylim(bottom=0)
    axes.set_ylabel("spilled [%]")
