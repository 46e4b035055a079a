"""The chosen pour: where it lies among the actions, and what it spills."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .drawing import BLUE, INK, ORANGE, new_figure, styled
from .readouts import Readout, field, to_chart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import SubFigure
    from xarray import DataTree

LEVELS = (0, 1, 2, 5, 10, 20, 40, 70, 100)  # percent: it matters where little is spilled
BAD = 0.9  # quantile of the draws, of which a map is shown beside that of the expectation
ALIKE = 2.0  # standard errors of a paired difference within which two actions are alike
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
    """Expected spillage, with the actions that cannot be told from the chosen one, and a quantile
    over the draws."""
    from matplotlib.patches import Patch

    actions = tree["actions"]
    spilled = 100.0 * actions["spilled"].to_numpy()
    expected = 100.0 * actions["risk"].to_numpy()
    bad = np.quantile(spilled, BAD, axis=0)
    x = np.degrees(actions["angular_velocity"].to_numpy())
    y = 100.0 * actions["distance"].to_numpy()
    values = {"expected": expected, f"in {100 * BAD:.0f} % of the draws at most": bad}
    readouts = []
    for axes, (title, percent) in zip(panels, values.items(), strict=True):
        shades = axes.contourf(x, y, percent.T, levels=LEVELS, cmap="Greys", alpha=0.8)
        lines = axes.contour(x, y, percent.T, levels=LEVELS[1:4], colors=INK, linewidths=0.6)
        axes.clabel(lines, fmt="%g %%", fontsize=7.5)
        axes.set_title(title, loc="left")
        axes.set_xlabel("angular velocity [deg/s]")
        _mark_choices(axes, tree)
        readouts.append(field(axes, x, y, values, "%"))
    alike = as_good(actions["spilled"].to_numpy(), actions["risk"].to_numpy())
    panels[0].contourf(
        x, y, alike.T.astype(float), levels=(0.5, 1.5), colors="none", hatches=["...."]
    )
    panels[0].set_ylabel("distance from lip to receiver's axis [cm]")
    figure.colorbar(shades, ax=list(panels), label="spilled [%]")
    handles, labels = panels[0].get_legend_handles_labels()
    handles.append(Patch(facecolor="none", edgecolor=INK, hatch="....", lw=0.0))
    figure.legend(handles, [*labels, "as good, as far as these draws tell"],
                  loc="outside upper center", ncols=3)  # fmt: skip
    return readouts


def as_good(spilled: NDArray, risk: NDArray) -> NDArray[np.bool_]:
    """Actions that these draws cannot tell from the best one.

    Differences are paired by draw, so what all actions spill of a liquid alike counts for nothing.

    Args:
        spilled: Of each draw, shape (draws, W, D).
        risk: What is least at the best action, shape (W, D).

    Returns:
        Shape (W, D).
    """
    best = np.unravel_index(np.argmin(risk), risk.shape)
    apart = spilled - spilled[:, *best][:, None, None]
    error = apart.std(axis=0, ddof=1) / np.sqrt(len(apart))
    return apart.mean(axis=0) <= ALIKE * error


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
