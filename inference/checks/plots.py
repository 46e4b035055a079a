"""Figures of the checks, of plain arrays. Matplotlib is imported by whoever asks for one."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import PercentFormatter

from .._lazy import stats
from ..figures import COLOURS, GREY, INK, bare, check_axes
from . import bands
from .ranks import bin_count

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BAND = "#e4e7eb"
SIZE = (5.2, 3.9)  # inch
LEGEND_BELOW: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16), "ncols": 3}
COVERAGE_LEVELS = 100  # at which a coverage curve is drawn


class Rates(NamedTuple):
    """Shares of intervals that held the truth, at k nominal levels for q quantities."""

    levels: np.ndarray  # [k]
    rate: np.ndarray  # [k, q]
    low: np.ndarray  # [k, q], lower end of each rate's interval
    high: np.ndarray  # [k, q]


class Curve(NamedTuple):
    """Expected coverage against credibility, with its pointwise band; each [L + 2]."""

    credibility: np.ndarray
    expected_coverage: np.ndarray
    low: np.ndarray
    high: np.ndarray


def plot_ecdf_difference(
    names: Sequence[str], ranks: np.ndarray, draws: int, ax: "Axes | None", level: float
) -> "Axes":
    """ECDF of ranks [R, q], each from 0 to `draws`, minus that of uniform ranks."""
    ax = _axes(ax)
    n = len(ranks)
    limits = bands.band(n, draws, level)
    z = _closed(limits.z, 1.0)
    lower, upper = (_closed(edge / n - limits.z, 0.0) for edge in (limits.lower, limits.upper))
    label = f"{100 * level:g} % band of the whole curve"
    ax.fill_between(z, lower, upper, color=BAND, lw=0, label=label)
    ax.axhline(0.0, color=GREY, lw=0.8)
    for j, name in enumerate(names):
        below = bands.counts_below(ranks[:, j], draws) / n - limits.z
        ax.plot(z, _closed(below, 0.0), color=_colour(j), lw=1.6, label=name)
    ax.set_xlim(0.0, 1.0)
    reach = 1.15 * np.abs(ax.dataLim.intervaly).max()
    ax.set_ylim(-reach, reach)
    ax.set_xlabel("rank of the truth among the draws, as a fraction")
    ax.set_ylabel("ECDF − uniform")
    ax.set_title(f"{n} replicates", loc="right", color=GREY)
    return _finish(ax, **LEGEND_BELOW)


def plot_histograms(
    names: Sequence[str], ranks: np.ndarray, draws: int, axes: Any, level: float
) -> "list[Axes]":
    """Histograms of ranks [R, q], each from 0 to `draws`; one axes per quantity."""
    check_axes(axes)
    n, q = ranks.shape
    if axes is None:
        size = (max(2.6 * q, 3.2), 2.6)
        axes = plt.subplots(1, q, figsize=size, sharey=True, layout="constrained")[1]
    panels = list(np.atleast_1d(axes).ravel())
    if len(panels) < q:
        raise ValueError(f"axes must hold one for each of {q} quantities, got {len(panels)}")
    bins = bin_count(n, draws)
    low, high = stats.binom.interval(level, n, 1 / bins)
    for j, (name, ax) in enumerate(zip(names, panels, strict=False)):
        counts = np.bincount(ranks[:, j] * bins // (draws + 1), minlength=bins)
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


def plot_coverage(
    names: Sequence[str], quantiles: np.ndarray, rates: Rates, ax: "Axes | None"
) -> "Axes":
    """Share of truths held by central intervals minus the nominal level.

    Args:
        names: Of q quantities.
        quantiles: Where each truth lies among its draws, [R, q]; gives the whole curve.
        rates: At the levels that were asked for.
        ax: To draw on; None makes a figure.
    """
    ax = _axes(ax)
    n, q = quantiles.shape
    limits = bands.band(n, COVERAGE_LEVELS - 1, 0.95)  # |2 u - 1| is uniform like u
    level = _closed(limits.z, 1.0)
    low, high = (_closed(edge / n - limits.z, 0.0) for edge in (limits.lower, limits.upper))
    ax.fill_between(level, low, high, color=BAND, lw=0, label="95 % band of the whole curve")
    ax.axhline(0.0, color=GREY, lw=0.8)
    for j, name in enumerate(names):
        within = np.sort(2 * np.abs(quantiles[:, j] - 0.5))
        curve = np.searchsorted(within, level, side="right") / n - level
        ax.plot(level, curve, color=_colour(j), lw=1.2, alpha=0.6)
        shifted = rates.levels + 0.008 * (j - (q - 1) / 2)  # so that bars do not hide each other
        error = np.stack([rates.rate - rates.low, rates.high - rates.rate])[:, :, j]
        excess = rates.rate[:, j] - rates.levels
        style = {"fmt": "o", "ms": 4.5, "capsize": 2.5, "lw": 1.2}
        ax.errorbar(shifted, excess, error, color=_colour(j), label=name, **style)
    ax.set_xlim(0.0, 1.0)
    ax.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))
    ax.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    ax.set_xlabel("nominal level of the central interval")
    ax.set_ylabel("truths held − nominal")
    ax.set_title(f"{n} replicates", loc="right", color=GREY)
    return _finish(ax, **LEGEND_BELOW)


def plot_tarp(curve: Curve, replicates: int, draws: int, ax: "Axes | None") -> "Axes":
    """Expected coverage against credibility, from so many replicates of so many draws."""
    ax = _axes(ax, (4.4, 4.2))
    n = replicates
    limits = bands.band(n, draws, 0.95)
    z = _closed(limits.z, 1.0)
    lower, upper = (_closed(edge / n, 1.0) for edge in (limits.lower, limits.upper))
    ax.fill_between(z, lower, upper, color=BAND, lw=0, label="95 % band of the whole curve")
    ax.plot([0, 1], [0, 1], color=GREY, lw=0.8)
    c = curve.credibility
    ax.fill_between(c, curve.low, curve.high, color=COLOURS[0], alpha=0.25, lw=0)
    ax.plot(
        c,
        curve.expected_coverage,
        color=COLOURS[0],
        lw=1.6,
        label="joint posterior, 95 % by bootstrap",
    )
    ax.set_xlim(0.0, 1.0)
    ax.set_ylim(0.0, 1.0)
    ax.set_aspect("equal")
    ax.set_xlabel("credibility")
    ax.set_ylabel("expected coverage")
    ax.set_title(f"{n} replicates", loc="right", color=GREY)
    return _finish(ax, loc="upper left")


def _axes(ax: "Axes | None", size: tuple[float, float] = SIZE) -> "Axes":
    check_axes(ax, "ax")
    return plt.subplots(figsize=size, layout="constrained")[1] if ax is None else ax


def _colour(j: int) -> str:
    return COLOURS[j % len(COLOURS)]


def _closed(values: np.ndarray, last: float) -> np.ndarray:
    """A curve that starts at 0 and ends at `last`."""
    return np.concatenate([[0.0], values, [last]])


def _finish(ax: "Axes", **place: Any) -> "Axes":
    ax.legend(**place, frameon=False, fontsize="small", labelcolor=INK)
    return bare(ax)
