"""Figures of a calibration: the fit in time and by stroke."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..drawing import (
    BLUE,
    INK,
    LIGHT,
    ORANGE,
    Panels,
    hover,
    hover_strips,
    panels,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset, DataTree

    from ..drawing import Canvas

PLANE_COLOURS = (BLUE, ORANGE)


def draw_fit(tree: "DataTree", axes: "Canvas" = None) -> Panels:
    """Inclination against time: recorded, closest hypothesis and posterior prediction.

    One row of axes for each recording, one column for each plane.

    Args:
        tree: posterior.nc.
        axes: Where to draw, see `drawing.panels`.
    """
    recorded = tree["recorded"].to_dataset()
    members = np.unique(recorded["recording"])
    size = 8.6, 2.6 * len(members) + 0.4
    drawn = panels(axes, (len(members), 2), size, sharex="row", sharey=True)
    for row, member in zip(drawn.grid, members, strict=True):
        frames = np.flatnonzero(recorded["recording"].to_numpy() == member)
        for axis, plane in zip(row, recorded["plane"].to_numpy(), strict=True):
            part = {
                name: tree[name].to_dataset().sel(plane=plane).isel(frame=frames)
                for name in ("recorded", "closest", "posterior_predictive")
            }
            _draw_inclination(axis, part)
            axis.set_title(f"{plane} plane", loc="left")
        row[0].set_ylabel("inclination [deg]")
    for axis in drawn.grid[-1]:
        axis.set_xlabel("time [s]")
    drawn.legend(*drawn.grid[0, 0].get_legend_handles_labels())
    return drawn


def _draw_inclination(axes: "Axes", part: dict[str, "Dataset"]) -> None:
    time = part["recorded"]["time"].to_numpy()
    degrees = {name: np.degrees(data["inclination"].to_numpy()) for name, data in part.items()}
    predicted = degrees["posterior_predictive"].reshape(-1, len(time))
    low, high = predicted.min(axis=0), predicted.max(axis=0)
    axes.fill_between(
        time,
        low,
        high,
        color=BLUE,
        alpha=0.25,
        linewidth=0,
        label=f"range of {len(predicted)} posterior predictions",
    )
    axes.plot(time, degrees["closest"], color=ORANGE, linewidth=1.1, label="closest hypothesis")
    axes.plot(time, degrees["recorded"], color=INK, linewidth=0.9, label="recorded")
    axes.axhline(0.0, color=LIGHT, linewidth=0.8, zorder=0)

    def text_at(at: int) -> str:
        return (
            f"{time[at]:.2f} s: recorded {degrees['recorded'][at]:.2f}°, closest "
            f"{degrees['closest'][at]:.2f}°, predicted {low[at]:.2f}° to {high[at]:.2f}°"
        )

    hover_strips(axes, time, text_at)


def draw_strokes(tree: "DataTree", axes: "Canvas" = None) -> Panels:
    """RMS of recorded less predicted inclination by stroke and plane, a row for each recording;
    beside it the sd of the predictions.

    Args:
        tree: posterior.nc.
        axes: Where to draw, see `drawing.panels`.
    """
    recorded, predicted = (tree[name].to_dataset() for name in ("recorded", "posterior_predictive"))
    members = np.unique(recorded["recording"])
    drawn = panels(axes, (len(members), 1), (8.6, 2.2 * len(members) + 0.4))
    for axis, member in zip(drawn.grid[:, 0], members, strict=True):
        frames = np.flatnonzero(recorded["recording"].to_numpy() == member)
        _draw_strokes(axis, recorded.isel(frame=frames), predicted.isel(frame=frames))
        axis.set_ylabel("RMS [deg]")
    drawn.grid[-1, 0].set_xlabel("stroke")
    drawn.legend(*drawn.grid[0, 0].get_legend_handles_labels())
    return drawn


def _draw_strokes(axes: "Axes", recorded: "Dataset", predicted: "Dataset") -> None:
    numbers = recorded["stroke"].to_numpy()
    strokes = np.unique(numbers)
    seen = np.degrees(recorded["inclination"].to_numpy())
    shown = np.degrees(predicted["inclination"].to_numpy()).reshape(-1, *seen.shape)
    left, spread = seen - shown.mean(axis=0), shown.std(axis=0, ddof=1)
    for at, plane in enumerate(recorded["plane"].to_numpy()):
        rms = _rms_by(numbers, left[:, at])
        place = np.arange(len(strokes)) + 0.4 * (at - 0.5)
        bars = axes.bar(place, rms, 0.36, color=PLANE_COLOURS[at], label=f"{plane} plane")
        for bar, number, height in zip(bars, strokes, rms, strict=True):
            hover(bar, f"stroke {number}, {plane} plane: {height:.2f}°")
    usual = _rms_by(numbers, spread)
    axes.step(np.arange(-1, len(strokes) + 1), np.pad(usual, 1, mode="edge"), where="mid",
              color=INK, lw=1.0, label="sd of the predictions")  # fmt: skip
    axes.set_xlim(-0.6, len(strokes) - 0.4)
    axes.set_xticks(range(len(strokes)), [str(number) for number in strokes])


def _rms_by(numbers: NDArray, values: NDArray) -> NDArray[np.float64]:
    """RMS of values (T,) or (T, planes) in each group of equal numbers (T,)."""
    groups = [values[numbers == number] for number in np.unique(numbers)]
    seen = [group[np.isfinite(group)] for group in groups]  # none where all samples are missing
    return np.array([np.sqrt(np.mean(part**2)) if part.size else np.nan for part in seen])
