"""Figures of a criticism: where model and data differ, and what effects would explain."""

from collections.abc import Iterator, Mapping, Sequence
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
    hover_strips,
    panels,
)
from ..inputs.settings import FALSE_ALARM_RATE
from ..wording import spoken, unit_of
from .criticism_file import EffectStatus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset, DataTree

    from ..drawing import Canvas

MODEL_STYLES = {"before": (ORANGE, "before"), "after": (BLUE, "with the missing effect")}
BOTH_PLANES = "both planes"
BAND_SD = 2.0  # half width of a band

STATUS_GROUPS = {
    EffectStatus.NAMED: ("named", BLUE),
    EffectStatus.POSSIBLE: ("possible", BLUE),
    EffectStatus.LESS_LIKELY: ("less likely", GREY),
    EffectStatus.REFUTED: ("refuted", INK),
    EffectStatus.GAINS_NOTHING: ("rejected", ORANGE),
    EffectStatus.STILL_DIFFERS: ("rejected", ORANGE),
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


def residual_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """Observed less expected against time, a row for each recording, a column for each plane.

    Args:
        node: The group `stirs`.
        axes: Where to draw, see `drawing.panels`.
    """
    residual = node["residual"].to_dataset()
    members, planes = np.unique(residual["recording"]), residual["plane"].to_numpy()
    shape, size = (len(members), len(planes)), _size(len(members))
    drawn = panels(axes, shape, size, sharex="row", sharey=True)
    for row, member, windows in _rows(drawn, node):
        frames = np.flatnonzero(residual["recording"].to_numpy() == member)
        for panel, plane in zip(row, planes, strict=True):
            _draw_residual(panel, residual.isel(frame=frames).sel(plane=plane))
            _shade(panel, _strokes(windows, str(plane)))
            panel.set_title(f"{plane} plane", loc="left")
            panel.set_xlabel("time [s]")
        row[0].set_ylabel("observed less expected [deg]")
    drawn.legend(*drawn.grid[0, 0].get_legend_handles_labels())
    return drawn


def _rows(drawn: Panels, node: "DataTree") -> "Iterator[tuple[NDArray, int, Dataset]]":
    """The panels of each recording, its number, and its windows; of several, it is named above."""
    where = node["where"].to_dataset()
    members = np.unique(node["residual/recording"])
    for row, member in zip(drawn.grid, members, strict=True):
        # their files are numbered from 1
        names = where["recording"].to_numpy()
        mine = [str(name).startswith(f"{member + 1}-") for name in names]
        yield row, member, where.isel(window=np.flatnonzero(mine))
        if len(members) > 1:
            name = next((str(name) for name, own in zip(names, mine, strict=True) if own), "")
            row[0].set_title(f"{name}\n{row[0].get_title(loc='left')}", loc="left")


def _size(recordings: int) -> tuple[float, float]:
    """Of a figure with a row for each recording [inch]."""
    return 8.6, 2.5 * recordings + 0.5


def _draw_residual(axes: "Axes", part: "Dataset") -> None:
    time = part["time"].to_numpy()
    drawn = {when: style for when, style in MODEL_STYLES.items() if f"expected_{when}" in part}
    last = list(drawn)[-1]
    width = BAND_SD * np.degrees(part[f"sd_{last}"].to_numpy())
    axes.fill_between(
        time, -width, width, color=GREY, alpha=0.3, linewidth=0, label="±2 sd of noise and model"
    )
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    left = {
        when: np.degrees((part["observed"] - part[f"expected_{when}"]).to_numpy()) for when in drawn
    }
    for when, (colour, label) in drawn.items():
        axes.plot(time, left[when], color=colour, linewidth=1.2, label=label)

    def text_at(at: int) -> str:
        values = (f"{MODEL_STYLES[when][1]} {angle[at]:.2f}°" for when, angle in left.items())
        return f"{time[at]:.2f} s: {', '.join(values)}"

    hover_strips(axes, time, text_at)


def _shade(axes: "Axes", strokes: "Dataset") -> None:
    sure = strokes["p_value_before"].to_numpy() < FALSE_ALARM_RATE
    for at in np.flatnonzero(sure):
        start, stop = (float(strokes[edge][at]) for edge in ("start_s", "stop_s"))
        axes.axvspan(start, stop, color=ORANGE, alpha=0.14, linewidth=0, zorder=0)
        axes.text(
            (start + stop) / 2.0,
            1.0,
            f"{int(strokes['stroke'][at])}",
            transform=axes.get_xaxis_transform(),
            ha="center",
            va="bottom",
            fontweight="bold",
        )


def stroke_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """RMS of observed less expected, by stroke and plane and by the gripper's speed.

    Args:
        node: The group `stirs`.
        axes: Where to draw, see `drawing.panels`.
    """
    residual = node["residual"].to_dataset()
    recordings = len(np.unique(residual["recording"]))
    drawn = panels(axes, (recordings, residual.sizes["plane"] + 1), _size(recordings), sharey=True)
    for row, _, windows in _rows(drawn, node):
        for panel, (title, part, ticks) in zip(row, _bars(residual, windows), strict=True):
            _draw_bars(panel, part, ticks)
            panel.set_title(title, loc="left")
            by_speed = title == BOTH_PLANES
            panel.set_xlabel("gripper's speed [cm/s]" if by_speed else "stroke")
        row[0].set_ylabel("RMS [deg]")
    drawn.legend(*drawn.grid[0, 0].get_legend_handles_labels())
    return drawn


def _bars(residual: "Dataset", windows: "Dataset") -> Iterator[tuple[str, "Dataset", list[str]]]:
    """Title, windows and their names, of each panel of a recording."""
    for plane in residual["plane"].to_numpy():
        strokes = _strokes(windows, str(plane))
        yield f"{plane} plane", strokes, [f"{int(k)}" for k in strokes["stroke"]]
    by_speed = windows.isel(window=np.flatnonzero(windows["speed"].to_numpy() != ""))
    speeds = [str(speed).removesuffix(" cm/s") for speed in by_speed["speed"].to_numpy()]
    yield BOTH_PLANES, by_speed, speeds


def _draw_bars(axes: "Axes", part: "Dataset", ticks: list[str]) -> None:
    at = np.arange(len(ticks))
    drawn = {when: style for when, style in MODEL_STYLES.items() if f"rms_{when}" in part}
    width = 0.8 / len(drawn)
    for k, (when, (colour, label)) in enumerate(drawn.items()):
        shift = (k - (len(drawn) - 1) / 2.0) * width
        height = np.degrees(part[f"rms_{when}"].to_numpy())
        axes.bar(at + shift, height, width, color=colour, label=label)
    sure = part["p_value_before"].to_numpy() < FALSE_ALARM_RATE
    top = np.degrees(part["rms_before"].to_numpy())
    label = f"surely different (p < {FALSE_ALARM_RATE:g})"
    shift = -(len(drawn) - 1) / 2.0 * width
    axes.scatter(at[sure] + shift, 1.05 * top[sure], s=28, marker="*", color=INK, label=label)
    axes.set_xticks(at, ticks)


def _strokes(windows: "Dataset", plane: str) -> "Dataset":
    by_speed = windows["speed"].to_numpy() != ""
    return windows.isel(window=np.flatnonzero(~by_speed & (windows["channel"] == plane).to_numpy()))


def held_out_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """RMS on recordings that were not fitted, against the RMS of noise.

    Args:
        node: A source that has the group `held_out`.
        axes: Where to draw, see `drawing.panels`.
    """
    held = node["held_out"].to_dataset()
    rows = [
        (f"{spoken(str(name))}\n{recording}", held.sel(explanation=name, recording=recording))
        for name in held["explanation"].to_numpy()
        for recording in held["recording"].to_numpy()
    ]
    drawn = panels(axes, (1, 1), (8.6, 0.55 * len(rows) + 1.2))
    panel = drawn.grid[0, 0]
    for at, (_, row) in enumerate(rows):
        values = {name: float(np.degrees(row[name])) for name in HELD_OUT_MARKS}
        _draw_held_out(panel, at, values)
    panel.set_yticks(range(len(rows)), [label for label, _ in rows])
    panel.set_ylim(len(rows) - 0.4, -0.6)
    panel.set_xlim(left=0.0)
    panel.set_xlabel("RMS of observed less expected [deg]")
    handles, labels = panel.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    drawn.legend(list(once.values()), list(once), ncols=len(once))
    return drawn


HELD_OUT_MARKS = {
    "noise": ("|", GREY, "noise alone"),
    "floor": ("|", INK, "noise is below in 99 %"),
    "before": ("s", ORANGE, "before"),
    "after": ("o", BLUE, "after"),
}


def _draw_held_out(axes: "Axes", at: int, values: Mapping[str, float]) -> None:
    axes.barh(at, values["floor"], 0.5, color=LIGHT, zorder=0)
    axes.plot([values["before"], values["after"]], [at, at], color=GREY, linewidth=1.0)
    for name, (marker, colour, label) in HELD_OUT_MARKS.items():
        size, edge = (18, 2.0) if marker == "|" else (8, 0.0)
        axes.plot(
            values[name],
            at,
            marker,
            color=colour,
            markersize=size,
            markeredgewidth=edge,
            label=label,
        )


def pour_residual_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """Observed against expected fractions of each pour, a panel for each outcome.

    Args:
        node: The group `pours`.
        axes: Where to draw, see `drawing.panels`.
    """
    residual = node["residual"].to_dataset()
    outcomes = residual["outcome"].to_numpy()
    drawn = panels(axes, (1, len(outcomes)), (4.3 * len(outcomes), 3.9))
    for panel, outcome in zip(drawn.grid[0], outcomes, strict=True):
        _draw_pours(panel, residual.sel(outcome=outcome))
        panel.set_title(str(outcome), loc="left")
        panel.set_xlabel("expected [% of the liquid]")
    drawn.grid[0, 0].set_ylabel("observed [% of the liquid]")
    drawn.legend(*drawn.grid[0, 0].get_legend_handles_labels())
    return drawn


def _draw_pours(axes: "Axes", part: "Dataset") -> None:
    observed = 100.0 * part["observed"].to_numpy()
    drawn: list[NDArray] = [observed]
    markers = {"before": "s", "after": "o"}
    for when, (colour, label) in MODEL_STYLES.items():
        if f"expected_{when}" not in part:
            continue
        expected = 100.0 * part[f"expected_{when}"].to_numpy()
        spread = BAND_SD * 100.0 * part[f"sd_{when}"].to_numpy()
        drawn += [expected - spread, expected + spread]
        axes.errorbar(
            expected,
            observed,
            xerr=spread,
            fmt=markers[when],
            color=colour,
            markerfacecolor="none" if when == "before" else colour,
            elinewidth=0.8,
            label=f"{label}, ±2 sd",
        )
    ends = [np.nanmin(drawn), np.nanmax(drawn)]
    axes.plot(ends, ends, color=GREY, linewidth=0.8, zorder=0, label="as expected")


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
