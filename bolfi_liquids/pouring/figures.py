"""Figures of a chosen pour: where it lies among the actions, and what it spills."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..drawing import BLUE, INK, ORANGE, Panels, hover, hover_points, new_figure, panels
from ..seeds import Phase, generator
from ..wording import spilled as spilled_text
from .spillage import ACTION, RISK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import QuadContourSet
    from matplotlib.figure import Figure
    from xarray import DataTree

    from ..drawing import Canvas

PERCENT_LEVELS = (0, 1, 2, 5, 10, 20, 40, 70, 100)
"""Contour levels of the spilled percentage, denser where little is spilled."""

BAD_CASE = 0.9  # quantile over the draws of the second map
HOVER_STEPS = 12  # actions along each axis whose spillage is shown under the pointer
SURE, BOOTSTRAP_SAMPLES = 0.95, 200
"""Confidence that an action is worse, and number of bootstrap samples for it."""

SHOWN_OUTCOMES = 160
"""Equally probable ones, of more that were judged."""

MIN_COMPARED_DRAWS = 8
"""Fewer draws cannot show that an action is worse."""

CHOICES = {"chosen": (BLUE, "o", "chosen pour"), "plug_in": (ORANGE, "s", "best at θ* alone")}
"""Colour, marker and label of the two actions, by their group in pour.nc."""


def map_plot(tree: "DataTree", axes: "Canvas" = None) -> Panels:
    """Expected spillage over the actions, with the chosen one and the plug-in.

    Args:
        tree: pour.nc.
        axes: Where to draw, see `drawing.panels`.
    """
    drawn = panels(axes, (1, 1), (4.6, 3.6))
    axis = drawn.grid[0, 0]
    drawn.figure.colorbar(draw_expected(axis, tree), ax=axis)
    drawn.legend(*axis.get_legend_handles_labels())
    return drawn


def pour_figure(tree: "DataTree") -> "Figure":
    """Spillage over the actions, as expected and in a bad case (above), and of the two choices over
    outcomes (below).

    Args:
        tree: pour.nc.
    """
    from matplotlib.patches import Patch

    actions = tree["actions"].to_dataset()
    spilled = actions["spilled"].to_numpy()
    x, y = action_axes(tree)
    figure = new_figure(8.6, 6.4)
    upper, lower = figure.subfigures(2, 1, height_ratios=(5, 4))
    expected, bad = upper.subplots(1, 2, sharey=True)
    shades = draw_expected(expected, tree)
    handles, labels = expected.get_legend_handles_labels()
    row, column = (
        int(np.argmin(np.abs(actions[name].to_numpy() - tree["chosen"].attrs[name])))
        for name in ACTION
    )
    alike = not_surely_worse(spilled, tree.attrs["risk"], (row, column))
    if alike.any():
        expected.contourf(
            x, y, alike.T.astype(float), levels=(0.5, 1.5), colors="none", hatches=["...."]
        )
        handles.append(Patch(facecolor="none", edgecolor=INK, hatch="....", lw=0.0))
        labels.append("not surely worse than the chosen")
    draw_map(bad, x, y, 100.0 * np.quantile(spilled, BAD_CASE, axis=0))
    mark_choices(bad, tree)
    bad.set_title(f"in {100 * BAD_CASE:.0f} % of the draws at most", loc="left")
    bad.set_xlabel(expected.get_xlabel())
    upper.colorbar(shades, ax=[expected, bad], label="spilled [%]")
    upper.legend(handles, labels, loc="outside upper center", ncols=3)
    draw_outcomes(lower.subplots(), tree)
    return figure


def action_axes(tree: "DataTree") -> tuple[NDArray, NDArray]:
    """Angular velocities [deg/s] and distances [cm] of the actions that were tried.

    Args:
        tree: pour.nc.
    """
    rates, distances = (tree["actions"][name].to_numpy() for name in ACTION)
    return np.degrees(rates), 100.0 * distances


def draw_expected(axes: "Axes", tree: "DataTree") -> "QuadContourSet":
    """The risk [%] of each action, with the chosen one and the plug-in."""
    x, y = action_axes(tree)
    shades = draw_map(axes, x, y, 100.0 * tree["actions"]["risk"].to_numpy())
    mark_choices(axes, tree)
    risk = "expected" if tree.attrs["risk"] == "mean" else "CVaR"
    axes.set_title(f"spilled [%], {risk}", loc="left")
    axes.set_xlabel("angular velocity [deg/s]")
    axes.set_ylabel("distance from lip to receiver's axis [cm]")
    return shades


def draw_map(axes: "Axes", x: NDArray, y: NDArray, percent: NDArray) -> "QuadContourSet":
    """Percentages (W, D) over angular velocities x (W,) [deg/s] and distances y (D,) [cm]."""
    some = tuple(slice(None, None, -(-len(axis) // HOVER_STEPS)) for axis in (x, y))
    turn, apart = (part.ravel() for part in np.meshgrid(x[some[0]], y[some[1]], indexing="ij"))
    shown = zip(turn, apart, percent[some].ravel(), strict=True)
    texts = [f"{a:.0f}°/s, {b:.1f} cm: {spilled_text(c / 100.0)}" for a, b, c in shown]
    hover_points(axes, turn, apart, texts)
    shades = axes.contourf(x, y, percent.T, levels=PERCENT_LEVELS, cmap="Greys", alpha=0.8)
    lines = axes.contour(x, y, percent.T, levels=PERCENT_LEVELS[1:4], colors=INK, linewidths=0.6)
    axes.clabel(lines, fmt="%g %%", fontsize=7.5)
    return shades


def not_surely_worse(spilled: NDArray, risk: str, chosen: tuple[int, int]) -> NDArray[np.bool_]:
    """Actions that these draws do not show, at `SURE`, to be worse than the chosen one.

    The difference of two actions is paired by draw, which removes what all actions spill of a
    liquid alike; its interval is a bootstrap over draws.

    Args:
        spilled: Of each draw, shape (draws, W, D).
        risk: Which measure of `spillage.RISK` is compared.
        chosen: Row and column of the chosen action.

    Returns:
        Shape (W, D); none of them where there are fewer than `MIN_COMPARED_DRAWS` draws.
    """
    if len(spilled) < MIN_COMPARED_DRAWS:
        return np.zeros(spilled.shape[1:], bool)
    again = generator(0, Phase.BOOTSTRAP).integers(
        len(spilled), size=(BOOTSTRAP_SAMPLES, len(spilled))
    )
    risks = np.stack([RISK[risk](spilled[draws]) for draws in again])
    return np.quantile(risks - risks[:, *chosen][:, None, None], 1.0 - SURE, axis=0) <= 0.0


def mark_choices(axes: "Axes", tree: "DataTree") -> None:
    """The chosen action and the plug-in."""
    for name, (colour, marker, label) in CHOICES.items():
        action = tree[name].attrs
        turn, apart = np.degrees(action["angular_velocity"]), 100.0 * action["distance"]
        face = colour if name == "chosen" else "none"  # hollow: both stay visible in one place
        (mark,) = axes.plot(
            turn,
            apart,
            marker,
            color=colour,
            markerfacecolor=face,
            markersize=8 if name == "chosen" else 12,
            label=label,
            clip_on=False,
            zorder=5,
        )
        hover(mark, f"{label}: {turn:.1f}°/s, {apart:.2f} cm")


def draw_outcomes(axes: "Axes", tree: "DataTree") -> None:
    """Spilled percentage of each outcome of both actions, 90 % of them, and their means."""
    for at, (name, (colour, marker, _)) in enumerate(CHOICES.items()):
        percent = 100.0 * tree[name]["spilled"].to_numpy()
        shown = np.quantile(percent, np.linspace(0.0, 1.0, min(len(percent), SHOWN_OUTCOMES)))
        spread = np.linspace(-0.18, 0.18, len(shown))
        axes.plot(shown, at + spread, ".", color=colour, alpha=0.45, markersize=5)
        low, high = np.quantile(percent, (0.05, 0.95))
        axes.plot([low, high], [at + 0.3] * 2, color=colour, linewidth=2.0)
        axes.plot(percent.mean(), at + 0.3, marker, color=colour, markersize=7)
    axes.set_yticks(range(len(CHOICES)), [label for _, _, label in CHOICES.values()])
    axes.set_ylim(len(CHOICES) - 0.4, -0.5)
    axes.set_xlim(left=0)
    axes.set_xlabel("spilled [%]")
