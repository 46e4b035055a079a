"""Figures of a fit, of plain arrays. Matplotlib is imported by whoever asks for one."""

from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from xarray import DataTree

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .history import History
    from .result import Fit

INK, GREY = "#1f2933", "#8a94a0"
COLOURS = ("#2463a6", "#d1591a", "#2d8659", "#8a4fa3", "#b8860b", "#5b6770", "#c2185b", "#00838f")
OBSERVED, CLOSEST, PREDICTED = INK, COLOURS[1], COLOURS[0]
MAX_PANELS = 6  # channels of a signal that are drawn
PREDICTIVE_QUANTILES = 0.05, 0.5, 0.95  # quantiles of the predictive distribution


def check_axes(axes: object, name: str = "axes") -> None:
    """Raise ValueError unless these are axes of Matplotlib, one or many, or None."""
    from matplotlib.axes import Axes

    given = [] if axes is None else np.atleast_1d(np.asarray(axes, object)).ravel()
    if not all(isinstance(one, Axes) for one in given):
        raise ValueError(f"{name} must be of Matplotlib, as of plt.subplots(), got {axes!r:.100}")


def plot_search(history: "History", ax: "Axes | None") -> "Axes":
    """See `Fit.plot_search`."""
    check_axes(ax, "ax")
    if ax is None:
        ax = plt.subplots(figsize=(5.2, 3.4), layout="constrained")[1]
    at, discrepancy = np.maximum(history.rounds + 1, 0), history.discrepancy  # 0: made before
    there = np.isfinite(discrepancy)
    ax.plot(at[there], discrepancy[there], "o", ms=4, color=PREDICTED, label="simulation")
    if there.any():
        each = np.unique(at[there])
        least = [discrepancy[there & (at <= one)].min() for one in each]
        ax.step(each, least, where="post", color=CLOSEST, lw=1.4, label="least so far")
        if discrepancy[there].min() > 0.0:
            ax.set_yscale("log")
    failed = at[~there]
    if failed.size:
        low = ax.get_ylim()[0]
        ax.plot(failed, np.full(len(failed), low), "x", color=GREY, label="failed", clip_on=False)
    ax.set_xlabel("round")
    ax.set_ylabel("discrepancy")
    ax.legend(frameon=False, fontsize="small")
    return bare(ax)


def plot_predictive(fit: "Fit", sampled: DataTree | None, axes: Any) -> "list[Axes]":
    """See `Fit.plot_predictive`; what has another shape than the data is left out."""
    if not isinstance(sampled, DataTree | None):
        raise ValueError(f"sampled must be what `sample` returned or None, got {sampled!r:.100}")
    check_axes(axes)
    tree = fit.sample(draws=250, warmup=250, warn=False) if sampled is None else sampled
    observed, closest = fit.observed, fit.closest.signal
    panels = _channels(observed)[:MAX_PANELS]
    near = _channels(closest) if closest.shape == observed.shape else None
    groups = tree["posterior_predictive"] if "posterior_predictive" in tree.children else {}
    draws = None
    if "signal" in groups and groups["signal"].shape[2:] == observed.shape:
        predicted = groups["signal"].to_numpy().reshape(-1, *observed.shape)
        draws = np.stack([_channels(one) for one in predicted], axis=1)  # [channel, n, t]
    size = (5.2, 1.2 + 1.8 * len(panels))
    given = some_axes(axes, len(panels), "channels", nrows=len(panels), figsize=size, sharex=True)
    for j, (ax, values) in enumerate(zip(given, panels, strict=True)):
        index = np.arange(len(values))
        if draws is not None:
            low, middle, high = np.quantile(draws[j], PREDICTIVE_QUANTILES, axis=0)
            label = "predicted, 90 %"
            ax.fill_between(index, low, high, color=PREDICTED, alpha=0.25, lw=0, label=label)
            ax.plot(index, middle, color=PREDICTED, lw=1.0)
        if near is not None:
            ax.plot(index, near[j], color=CLOSEST, lw=1.2, label="closest simulation")
        ax.plot(index, values, ".", ms=3, color=OBSERVED, label="observed")
        bare(ax)
    given[0].legend(frameon=False, fontsize="small")
    given[-1].set_xlabel("sample")
    return given


def some_axes(axes: Any, count: int, of: str, **figure: Any) -> "list[Axes]":
    """The first `count` of the axes that a user gives; None makes a `figure`, see plt.subplots.

    Raises:
        ValueError: these are no axes, or too few.
    """
    check_axes(axes)
    if axes is None:
        axes = plt.subplots(layout="constrained", **figure)[1]
    given = list(np.atleast_1d(axes).ravel())
    if len(given) < count:
        raise ValueError(f"axes must hold one for each of {count} {of}, got {len(given)}")
    return given[:count]


def _channels(output: np.ndarray) -> np.ndarray:
    """[t, *channels] -> [channel, t]; a number is a series of one sample."""
    return np.atleast_1d(output).reshape(len(np.atleast_1d(output)), -1).T


def bare(ax: "Axes") -> "Axes":
    """Axes with two spines, quiet ones."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color(GREY)
    ax.tick_params(colors=INK, labelsize="small")
    return ax
