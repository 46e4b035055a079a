"""Figures of effects: gain and score of each, cosines between signatures, coefficients."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..drawing import (
    BLUE,
    GREY,
    INK,
    LIGHT,
    ORANGE,
    Panels,
    panels,
)
from ..wording import spoken, unit_of
from .criticism_file import EffectStatus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import DataTree

    from ..drawing import Canvas

STATUS_GROUPS = {
    EffectStatus.NAMED: ("named", BLUE),
    EffectStatus.POSSIBLE: ("possible", BLUE),
    EffectStatus.LESS_LIKELY: ("less likely", GREY),
    EffectStatus.REFUTED: ("refuted", INK),
    EffectStatus.REJECTED: ("rejected", ORANGE),
    EffectStatus.NOT_NEEDED: ("not needed", GREY),
    EffectStatus.NOT_REFITTED: ("untested", GREY),
    EffectStatus.FAILED: ("untested", GREY),
}
"""Label in the legend and colour of each status."""

LINEAR_GAIN = 4.0
"""Log likelihood up to which its axis is linear: the margin that decides between explanations."""

USUAL_SCORE = 2.0  # sd; 19 of 20 scores stay below it where nothing is missing
HISTOGRAM_BINS = 40
INTERVAL = (0.05, 0.95)  # quantiles of the interval that is shown
DARK_CELL = 0.6  # cosine above which the number in a cell is white


def any_fitted(node: "DataTree") -> bool:
    """Whether an effect was fitted, so that there is a gain to show.

    Args:
        node: The group `stirs` or `pours`.
    """
    return bool(np.isfinite(node["effects/gain"]).any())


def score_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """What each effect alone gains when it is fitted (left), and its score before (right).

    Where no effect was fitted, there is no left side.

    Args:
        node: The group `stirs` or `pours`.
        axes: Where to draw, see `drawing.panels`.
    """
    effects = node["effects"].to_dataset()
    gain, score = effects["gain"].to_numpy(), np.abs(effects["score"].to_numpy())
    # the last of these decides; NaN, which was not fitted or not tested, goes last
    order = np.lexsort((-np.nan_to_num(score), -np.nan_to_num(gain, nan=-np.inf)))
    names = [spoken(str(name)) for name in effects["effect"].to_numpy()[order]]
    states = [EffectStatus(str(status)) for status in effects["status"].to_numpy()[order]]
    ratios = (3, 2) if any_fitted(node) else (1,)
    shape, size = (1, len(ratios)), (8.6, 0.26 * len(names) + 1.2)
    drawn = panels(axes, shape, size, sharey=True, width_ratios=ratios)
    left, right = drawn.grid[0, 0], drawn.grid[0, -1]
    if left is not right:
        _draw_gains(left, gain[order], states)
        drawn.legend(*left.get_legend_handles_labels(), ncols=len(STATUS_GROUPS))
    right.axvspan(0.0, USUAL_SCORE, color=LIGHT, linewidth=0, zorder=0)
    counts = effects["score"].to_numpy() * effects["side"].to_numpy() >= 0.0
    for at, status in enumerate(states):
        value, colour = score[order[at]], STATUS_GROUPS[status][1]
        right.plot([0.0, value], [at, at], color=colour, linewidth=1.0)
        inside = colour if counts[order[at]] else "white"
        right.plot(value, at, "o", color=colour, markerfacecolor=inside, markersize=5)
    right.set_xlim(left=0.0)
    right.set_xlabel("size of the score [sd]")
    left.set_yticks(range(len(names)), names)
    left.set_ylim(len(names) - 0.4, -0.6)
    return drawn


def _draw_gains(axes: "Axes", gain: NDArray, states: list[EffectStatus]) -> None:
    from matplotlib.ticker import FuncFormatter

    def plain(value: float, _) -> str:
        return "" if 0.0 < abs(value) < LINEAR_GAIN else f"{value:g}"  # they would overlap

    axes.set_xscale("symlog", linthresh=LINEAR_GAIN, linscale=0.5)
    axes.xaxis.set_major_formatter(FuncFormatter(plain))
    for group, colour in dict(STATUS_GROUPS.values()).items():
        rows = [at for at, status in enumerate(states) if STATUS_GROUPS[status][0] == group]
        if rows:
            axes.barh(rows, np.nan_to_num(gain[rows]), 0.7, color=colour, label=group)
    for at in np.flatnonzero(np.isnan(gain)):
        axes.text(0.0, float(at), " not fitted", va="center", color=GREY)
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.set_xlabel("gain in log likelihood")


def confusion_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """Size of the cosine between each two effects' signatures.

    Args:
        node: The group `stirs` or `pours`.
        axes: Where to draw, see `drawing.panels`.
    """
    confusion = node["confusion"].to_dataset()
    cosine = np.abs(confusion["cosine"].to_numpy())
    names = [spoken(str(name)) for name in confusion["effect"].to_numpy()]
    drawn = panels(axes, (1, 1), (0.45 * len(names) + 2.4, 0.36 * len(names) + 1.5))
    panel = drawn.grid[0, 0]
    image = panel.imshow(cosine, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    drawn.figure.colorbar(image, ax=panel, label="size of the cosine")
    panel.set_xticks(range(len(names)), names, rotation=45, ha="right", rotation_mode="anchor")
    panel.set_yticks(range(len(names)), names)
    panel.tick_params(length=0)
    panel.spines[:].set_visible(False)
    for (row, column), value in np.ndenumerate(cosine):
        colour, text = "white" if value > DARK_CELL else INK, f"{value:.2f}"
        panel.text(column, row, text, ha="center", va="center", color=colour, fontsize=8)
    return drawn


def coefficient_plot(tree: "DataTree", names: Sequence[str], axes: "Canvas" = None) -> Panels:
    """Posterior of each coefficient, with its 90 % interval and what would be no effect.

    Args:
        tree: criticism.nc.
        names: Of the accepted effects.
        axes: Where to draw, see `drawing.panels`.
    """
    drawn = panels(axes, (1, len(names)), (4.3 * max(len(names), 1) + 0.6, 3.0))
    for panel, name in zip(drawn.grid[0], names, strict=True):
        _draw_coefficient(panel, name, tree["posterior"][name].to_numpy().ravel())
    drawn.legend(*drawn.grid[0, 0].get_legend_handles_labels())
    return drawn


def _draw_coefficient(axes: "Axes", name: str, draws: NDArray) -> None:
    from ..models import EFFECTS

    density, _, _ = axes.hist(
        draws, bins=HISTOGRAM_BINS, density=True, color=BLUE, alpha=0.45, label="posterior"
    )
    low, high = np.quantile(draws, INTERVAL)
    below = -0.06 * np.max(density)  # under the bars, where it hides nothing
    axes.plot([low, high], [below, below], color=BLUE, linewidth=4.0, label="90 % interval")
    if name in EFFECTS:
        neutral = EFFECTS[name].neutral
        axes.axvline(neutral, color=INK, linestyle="--", linewidth=1.0, label="no effect")
    axes.set_yticks([])
    axes.set_xlabel(f"{spoken(name)} [{unit_of(name) or 'dimensionless'}]")
    axes.set_ylabel("density")
