"""Figures of the checks. Matplotlib is imported by whoever asks for one."""

from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import PercentFormatter

from .._lazy import stats
from ..figures import COLOURS, GREY, INK, bare, check_axes
from . import bands
from .ranks import bin_count

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .intervals import Coverage
    from .random_points import Tarp
    from .uniformity import SBC

BAND = "#e4e7eb"
SIZE = (5.2, 3.9)  # inch
LEGEND_BELOW: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16), "ncols": 3}
COVERAGE_LEVELS = 100  # at which a coverage curve is drawn


def plot_ecdf_difference(of: "SBC", ax: "Axes | None", level: float) -> "Axes":
    """ECDF of ranks minus that of uniform ranks."""
    ax = _axes(ax)
    n = len(of.replicates)
    z = _band(ax, n, of.draws, level)
    for j, name in enumerate(of.names):
        below = bands.counts_below(of.ranks[:, j], of.draws) / n - z
        ax.plot(_closed(z, 1.0), _closed(below, 0.0), color=_colour(j), lw=1.6, label=name)
    reach = 1.15 * np.abs(ax.dataLim.intervaly).max()
    ax.set_ylim(-reach, reach)
    ax.set_xlabel("rank of the truth among the draws, as a fraction")
    ax.set_ylabel("ECDF − uniform")
    return _finish(ax, n, **LEGEND_BELOW)


def plot_histograms(of: "SBC", axes: Any, level: float) -> "list[Axes]":
    """Histograms of ranks, one axes per quantity."""
    check_axes(axes)
    n, q = of.ranks.shape
    if axes is None:
        size = (max(2.6 * q, 3.2), 2.6)
        axes = plt.subplots(1, q, figsize=size, sharey=True, layout="constrained")[1]
    panels = list(np.atleast_1d(axes).ravel())
    if len(panels) < q:
        raise ValueError(f"axes must hold one for each of {q} quantities, got {len(panels)}")
    bins = bin_count(n, of.draws)
    low, high = stats.binom.interval(level, n, 1 / bins)
    for j, (name, ax) in enumerate(zip(of.names, panels, strict=False)):
        counts = np.bincount(of.ranks[:, j] * bins // (of.draws + 1), minlength=bins)
        ax.axhspan(low, high, color=BAND, lw=0)
        ax.axhline(n / bins, color=GREY, lw=0.8)
        ax.stairs(counts, np.linspace(0.0, 1.0, bins + 1), color=_colour(j), fill=True, alpha=0.35)
        ax.stairs(counts, np.linspace(0.0, 1.0, bins + 1), color=_colour(j), lw=1.2)
        ax.set_xlim(0.0, 1.0)
        ax.set_ylim(0.0, 1.15 * max(counts.max(), high))
        ax.set_title(name, color=INK)
        ax.set_xlabel("rank, as a fraction")
        bare(ax)
    panels[0].set_ylabel(f"replicates of {n}")
    return panels[:q]


def plot_coverage(of: "Coverage", ax: "Axes | None") -> "Axes":
    """Share of truths held by central intervals minus the nominal level: as a curve, and with exact
    99 % intervals at the levels that were asked for."""
    ax = _axes(ax)
    n, q = of.quantiles.shape
    z = _band(ax, n, COVERAGE_LEVELS - 1)  # |2 u - 1| is uniform like u
    level = _closed(z, 1.0)
    for j, name in enumerate(of.names):
        within = np.sort(2 * np.abs(of.quantiles[:, j] - 0.5))
        curve = np.searchsorted(within, level, side="right") / n - level
        ax.plot(level, curve, color=_colour(j), lw=1.2, alpha=0.6)
        shifted = of.levels + 0.008 * (j - (q - 1) / 2)  # so that bars do not hide each other
        error = np.stack([of.rate - of.low, of.high - of.rate])[:, :, j]
        excess = of.rate[:, j] - of.levels
        style = {"fmt": "o", "ms": 4.5, "capsize": 2.5, "lw": 1.2}
        ax.errorbar(shifted, excess, error, color=_colour(j), label=name, **style)
    ax.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))
    ax.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    ax.set_xlabel("nominal level of the central interval")
    ax.set_ylabel("truths held − nominal")
    return _finish(ax, n, **LEGEND_BELOW)


def plot_tarp(of: "Tarp", ax: "Axes | None") -> "Axes":
    """Expected coverage against credibility."""
    ax = _axes(ax, (4.4, 4.2))
    n = len(of.replicates)
    _band(ax, n, of.replicates.most, diagonal=True)
    ax.fill_between(of.credibility, of.low, of.high, color=COLOURS[0], alpha=0.25, lw=0)
    label = "joint posterior, 95 % by bootstrap"
    ax.plot(of.credibility, of.expected_coverage, color=COLOURS[0], lw=1.6, label=label)
    ax.set_ylim(0.0, 1.0)
    ax.set_aspect("equal")
    ax.set_xlabel("credibility")
    ax.set_ylabel("expected coverage")
    return _finish(ax, n, loc="upper left")


def _band(
    ax: "Axes", n: int, draws: int, level: float = 0.95, diagonal: bool = False
) -> np.ndarray:
    """Draw the simultaneous band of n ranks, less the diagonal unless that is drawn, too; returns
    where the band is known, z [draws]."""
    limits = bands.band(n, draws, level)
    z, last = _closed(limits.z, 1.0), float(diagonal)
    line = z if diagonal else np.zeros_like(z)
    lower, upper = (
        _closed(edge / n - (0.0 if diagonal else limits.z), last)
        for edge in (limits.lower, limits.upper)
    )
    label = f"{100 * level:g} % band of the whole curve"
    ax.fill_between(z, lower, upper, color=BAND, lw=0, label=label)
    ax.plot(z, line, color=GREY, lw=0.8)
    ax.set_xlim(0.0, 1.0)
    return limits.z


def _axes(ax: "Axes | None", size: tuple[float, float] = SIZE) -> "Axes":
    check_axes(ax, "ax")
    return plt.subplots(figsize=size, layout="constrained")[1] if ax is None else ax


def _colour(j: int) -> str:
    return COLOURS[j % len(COLOURS)]


def _closed(values: np.ndarray, last: float) -> np.ndarray:
    """A curve that starts at 0 and ends at `last`."""
    return np.concatenate([[0.0], values, [last]])


def _finish(ax: "Axes", n: int, **place: Any) -> "Axes":
    ax.set_title(f"{n} replicates", loc="right", color=GREY)
    ax.legend(**place, frameon=False, fontsize="small", labelcolor=INK)
    return bare(ax)
