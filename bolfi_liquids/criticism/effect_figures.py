"""Figures of effects: how well each explains, which look alike, how large one is."""

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
    new_figure,
    styled,
)
from ..reporting.criticism_sentences import unit_of, words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from xarray import DataTree

STATUSES = {
    "named": BLUE,
    "possible": BLUE,
    "less likely": GREY,
    "refuted": INK,
    "rejected": ORANGE,
    "not needed": GREY,
    "untested": GREY,
}
LINEAR = 4.0  # log likelihood up to which its axis is linear: what one must excel another by
USUAL = 2.0  # sd within which a score is nothing
BINS = 40
INSIDE = (0.05, 0.95)


def any_fitted(node: "DataTree") -> bool:
    """Whether an effect was fitted, so that there is a gain to show.

    Args:
        node: The group `stirs` or `pours`.
    """
    return bool(np.isfinite(node["effects/gain"]).any())


def score_plot(node: "DataTree") -> "Figure":
    """What each effect alone gains when it is fitted (left), and its score before (right).

    Where no effect was fitted, there is no left side.

    Args:
        node: The group `stirs` or `pours`.
    """
    effects = node["effects"].to_dataset()
    gain, score = effects["gain"].to_numpy(), np.abs(effects["score"].to_numpy())
    # the last of these decides; NaN, which was not fitted or not tested, goes last
    order = np.lexsort((-np.nan_to_num(score), -np.nan_to_num(gain, nan=-np.inf)))
    names = [words(str(name)) for name in effects["effect"].to_numpy()[order]]
    states = [str(status) for status in effects["status"].to_numpy()[order]]
    ratios = (3, 2) if any_fitted(node) else (1,)
    with styled():
        figure = new_figure(8.6, 0.26 * len(names) + 1.2)
        grid = figure.subplots(1, len(ratios), sharey=True, squeeze=False, width_ratios=ratios)
        left, right = grid[0, 0], grid[0, -1]
        if left is not right:
            _draw_gains(left, gain[order], states)
            figure.legend(loc="outside upper center", ncols=len(STATUSES))
        right.axvspan(0.0, USUAL, color=LIGHT, linewidth=0, zorder=0)
        counts = effects["score"].to_numpy() * effects["side"].to_numpy() >= 0.0
        for at, status in enumerate(states):
            value, colour = score[order[at]], _colour(status)
            right.plot([0.0, value], [at, at], color=colour, linewidth=1.0)
            inside = colour if counts[order[at]] else "white"
            right.plot(value, at, "o", color=colour, markerfacecolor=inside, markersize=5)
        right.set_xlim(left=0.0)
        right.set_xlabel("size of the score [sd]")
        left.set_yticks(range(len(names)), names)
        left.set_ylim(len(names) - 0.4, -0.6)
    return figure


def _draw_gains(axes: "Axes", gain: NDArray, states: list[str]) -> None:
    from matplotlib.ticker import FuncFormatter

    def plain(value: float, _) -> str:
        return "" if 0.0 < abs(value) < LINEAR else f"{value:g}"  # they would overlap

    axes.set_xscale("symlog", linthresh=LINEAR, linscale=0.5)
    axes.xaxis.set_major_formatter(FuncFormatter(plain))
    for group, colour in STATUSES.items():
        rows = [at for at, status in enumerate(states) if status.startswith(group)]
        if rows:
            axes.barh(rows, np.nan_to_num(gain[rows]), 0.7, color=colour, label=group)
    for at in np.flatnonzero(np.isnan(gain)):
        axes.text(0.0, float(at), " not fitted", va="center", color=GREY)
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.set_xlabel("gain in log likelihood")


def _colour(status: str) -> str:
    return next((c for group, c in STATUSES.items() if status.startswith(group)), GREY)


def confusion_plot(node: "DataTree") -> "Figure":
    """Size of the cosine between each two effects' signatures.

    Args:
        node: The group `stirs` or `pours`.
    """
    confusion = node["confusion"].to_dataset()
    cosine = np.abs(confusion["cosine"].to_numpy())
    names = [words(str(name)) for name in confusion["effect"].to_numpy()]
    with styled():
        figure = new_figure(0.45 * len(names) + 2.4, 0.36 * len(names) + 1.5)
        axes = figure.subplots()
        image = axes.imshow(cosine, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        figure.colorbar(image, ax=axes, label="size of the cosine")
        axes.set_xticks(range(len(names)), names, rotation=45, ha="right", rotation_mode="anchor")
        axes.set_yticks(range(len(names)), names)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        for (row, column), value in np.ndenumerate(cosine):
            colour = "white" if value > 0.6 else INK
            text = f"{value:.2f}"
            axes.text(column, row, text, ha="center", va="center", color=colour, fontsize=8)
    return figure


def coefficient_plot(tree: "DataTree", names: Sequence[str]) -> "Figure":
    """Posterior of each coefficient, with its 90 % interval and what would be no effect.

    Args:
        tree: criticism.nc.
        names: Of the accepted effects.
    """
    with styled():
        figure = new_figure(4.3 * max(len(names), 1) + 0.6, 3.0)
        grid = figure.subplots(1, len(names), squeeze=False)
        for axes, name in zip(grid[0], names, strict=True):
            _draw_coefficient(axes, name, tree["posterior"][name].to_numpy().ravel())
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _draw_coefficient(axes: "Axes", name: str, draws: NDArray) -> None:
    from ..models import EFFECTS

    density, _, _ = axes.hist(
        draws, bins=BINS, density=True, color=BLUE, alpha=0.45, label="posterior"
    )
    low, high = np.quantile(draws, INSIDE)
    below = -0.06 * np.max(density)  # under the bars, where it hides nothing
    axes.plot([low, high], [below, below], color=BLUE, linewidth=4.0, label="90 % interval")
    if name in EFFECTS:
        neutral = EFFECTS[name].neutral
        axes.axvline(neutral, color=INK, linestyle="--", linewidth=1.0, label="no effect")
    axes.set_yticks([])
    axes.set_xlabel(f"{words(name)} [{unit_of(name) or 'dimensionless'}]")
    axes.set_ylabel("density")
