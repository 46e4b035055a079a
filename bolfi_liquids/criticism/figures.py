"""Figures of a criticism: where model and data differ, and what effects would explain.

Each takes the group `stirs` or `pours` of criticism.nc and where to draw, see `drawing.panels`.
"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..calibration.figures import add_legend, draw_angles, draw_bars
from ..drawing import BLUE, GREY, INK, LIGHT, ORANGE, Panels, panels
from ..inputs.settings import FALSE_ALARM_RATE
from ..wording import spoken, unit_of
from .criticism_file import EffectStatus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import DataArray, Dataset, DataTree

    from ..drawing import Canvas

BAND = "±2 sd of noise and model"
MODEL_STYLES = {"before": (ORANGE, "before"), "after": (BLUE, "with the missing effect")}
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

HELD_OUT_MARKS = {
    "noise": ("|", GREY, "noise alone"),
    "floor": ("|", INK, "noise is below in 99 %"),
    "before": ("s", ORANGE, "before"),
    "after": ("o", BLUE, "after"),
}
"""Marker, colour and label of each RMS on held-out recordings."""

LINEAR_GAIN = 4.0
"""Log likelihood up to which its axis is linear."""

USUAL_SCORE = 2.0  # sd; 19 of 20 scores stay below it where nothing is missing
HISTOGRAM_BINS = 40
INTERVAL = (0.05, 0.95)  # quantiles of the interval that is shown
DARK_CELL = 0.6  # cosine above which the number in a cell is white


def residual_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """Observed less expected against time, a row for each recording, a column for each plane."""
    residual = node["residual"].to_dataset()
    members, planes = np.unique(residual["recording"]), residual["plane"].to_numpy()
    shape, size = (len(members), len(planes)), _size(len(members))
    drawn = panels(axes, shape, size, sharex="row", sharey=True)
    for row, part, windows in _rows(drawn, node):
        models, time = _models(part, "expected"), part["time"].to_numpy()
        for at, (panel, plane) in enumerate(zip(row, planes, strict=True)):
            lines = {
                label: (colour, np.degrees((part["observed"] - expected)[:, at].to_numpy()))
                for label, (colour, expected) in models.items()
            }
            (_, sd) = list(_models(part, "sd").values())[-1]
            width = BAND_SD * np.degrees(sd[:, at].to_numpy())
            draw_angles(panel, time, lines, {BAND: (GREY, -width, width)})
            _shade(panel, _strokes(windows, str(plane)))
            panel.set_title(f"{plane} plane", loc="left")
            panel.set_xlabel("time [s]")
        row[0].set_ylabel("observed less expected [deg]")
    add_legend(drawn, drawn.grid[0, 0])
    return drawn


def _models(part: "Dataset", what: str) -> dict[str, tuple[str, "DataArray"]]:
    """Label -> colour and values of WHAT_before and, where it is there, of WHAT_after."""
    return {
        label: (colour, part[f"{what}_{when}"])
        for when, (colour, label) in MODEL_STYLES.items()
        if f"{what}_{when}" in part
    }


def _rows(drawn: Panels, node: "DataTree") -> "Iterator[tuple[NDArray, Dataset, Dataset]]":
    """The panels of each recording, its residual and its windows; of several, each is named in the
    title of its first panel."""
    residual, where = node["residual"].to_dataset(), node["where"].to_dataset()
    member, names = residual["recording"].to_numpy(), where["recording"].to_numpy()
    for row, one in zip(drawn.grid, np.unique(member), strict=True):
        # their files are numbered from 1
        mine = np.flatnonzero([str(name).startswith(f"{one + 1}-") for name in names])
        yield row, residual.isel(frame=np.flatnonzero(member == one)), where.isel(window=mine)
        if len(drawn.grid) > 1 and mine.size:
            row[0].set_title(f"{names[mine[0]]}\n{row[0].get_title(loc='left')}", loc="left")


def _size(recordings: int) -> tuple[float, float]:
    """Width and height of a figure with a row for each recording [inch]."""
    return 8.6, 2.5 * recordings + 0.5


def _shade(axes: "Axes", strokes: "Dataset") -> None:
    """Shade and number the strokes that differ significantly."""
    sure = strokes["p_value_before"].to_numpy() < FALSE_ALARM_RATE
    for at in np.flatnonzero(sure):
        start, stop = (float(strokes[edge][at]) for edge in ("start_s", "stop_s"))
        axes.axvspan(start, stop, color=ORANGE, alpha=0.14, linewidth=0, zorder=0)
        style: dict[str, Any] = {"ha": "center", "va": "bottom", "fontweight": "bold"}
        transform, number = axes.get_xaxis_transform(), f"{int(strokes['stroke'][at])}"
        axes.text((start + stop) / 2.0, 1.0, number, transform=transform, **style)


def stroke_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """RMS of observed less expected, by stroke and plane and by the gripper's speed."""
    residual = node["residual"].to_dataset()
    recordings, planes = len(np.unique(residual["recording"])), residual["plane"].to_numpy()
    drawn = panels(axes, (recordings, len(planes) + 1), _size(recordings), sharey=True)
    for row, _, windows in _rows(drawn, node):
        for panel, plane in zip(row, planes, strict=False):
            strokes = _strokes(windows, str(plane))
            _draw_windows(panel, strokes, [f"{int(k)}" for k in strokes["stroke"]])
            panel.set_title(f"{plane} plane", loc="left")
            panel.set_xlabel("stroke")
        by_speed = windows.isel(window=np.flatnonzero(windows["speed"].to_numpy() != ""))
        speeds = [str(speed).removesuffix(" cm/s") for speed in by_speed["speed"].to_numpy()]
        _draw_windows(row[-1], by_speed, speeds)
        row[-1].set_title("both planes", loc="left")
        row[-1].set_xlabel("gripper's speed [cm/s]")
        row[0].set_ylabel("RMS [deg]")
    add_legend(drawn, drawn.grid[0, 0])
    return drawn


def _draw_windows(axes: "Axes", windows: "Dataset", ticks: list[str]) -> None:
    """RMS in each window, with a star where it is significant."""
    heights = {
        label: (colour, np.degrees(rms.to_numpy()))
        for label, (colour, rms) in _models(windows, "rms").items()
    }
    first = draw_bars(axes, ticks, heights)
    sure = windows["p_value_before"].to_numpy() < FALSE_ALARM_RATE
    top = 1.05 * np.degrees(windows["rms_before"].to_numpy())
    label = f"surely different (p < {FALSE_ALARM_RATE:g})"
    axes.scatter(first[sure], top[sure], s=28, marker="*", color=INK, label=label)


def _strokes(windows: "Dataset", plane: str) -> "Dataset":
    by_speed = windows["speed"].to_numpy() != ""
    return windows.isel(window=np.flatnonzero(~by_speed & (windows["channel"] == plane).to_numpy()))


def held_out_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """RMS on recordings that were not fitted, against the RMS of noise."""
    held = node["held_out"].to_dataset()
    pairs = [(e, r) for e in held["explanation"].to_numpy() for r in held["recording"].to_numpy()]
    drawn = panels(axes, (1, 1), (8.6, 0.55 * len(pairs) + 1.2))
    panel = drawn.grid[0, 0]
    for at, (explanation, recording) in enumerate(pairs):
        row = held.sel(explanation=explanation, recording=recording)
        values = {name: float(np.degrees(row[name])) for name in HELD_OUT_MARKS}
        panel.barh(at, values["floor"], 0.5, color=LIGHT, zorder=0)
        panel.plot([values["before"], values["after"]], [at, at], color=GREY, linewidth=1.0)
        for name, (marker, colour, label) in HELD_OUT_MARKS.items():
            size, edge = (18, 2.0) if marker == "|" else (8, 0.0)
            style = {"color": colour, "ms": size, "markeredgewidth": edge, "label": label}
            panel.plot(values[name], at, marker, **style)
    labels = [f"{spoken(str(explanation))}\n{recording}" for explanation, recording in pairs]
    panel.set_yticks(range(len(pairs)), labels)
    panel.set_ylim(len(pairs) - 0.4, -0.6)
    panel.set_xlim(left=0.0)
    panel.set_xlabel("RMS of observed less expected [deg]")
    add_legend(drawn, panel, ncols=len(HELD_OUT_MARKS))
    return drawn


def pour_residual_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """Observed against expected fractions of each pour, a panel for each outcome."""
    residual = node["residual"].to_dataset()
    outcomes = residual["outcome"].to_numpy()
    drawn = panels(axes, (1, len(outcomes)), (4.3 * len(outcomes), 3.9))
    for panel, outcome in zip(drawn.grid[0], outcomes, strict=True):
        _draw_pours(panel, residual.sel(outcome=outcome))
        panel.set_title(str(outcome), loc="left")
        panel.set_xlabel("expected [% of the liquid]")
    drawn.grid[0, 0].set_ylabel("observed [% of the liquid]")
    add_legend(drawn, drawn.grid[0, 0])
    return drawn


def _draw_pours(axes: "Axes", part: "Dataset") -> None:
    observed = 100.0 * part["observed"].to_numpy()
    drawn: list[NDArray] = [observed]
    expected, sd = _models(part, "expected"), _models(part, "sd")
    for marker, (label, (colour, values)) in zip("so", expected.items(), strict=False):
        middle, spread = 100.0 * values.to_numpy(), 100.0 * BAND_SD * sd[label][1].to_numpy()
        drawn += [middle - spread, middle + spread]
        face = "none" if marker == "s" else colour
        style = {"color": colour, "markerfacecolor": face, "elinewidth": 0.8}
        label = f"{label}, ±2 sd"
        axes.errorbar(middle, observed, xerr=spread, fmt=marker, label=label, **style)
    ends = [np.nanmin(drawn), np.nanmax(drawn)]
    axes.plot(ends, ends, color=GREY, linewidth=0.8, zorder=0, label="as expected")


def score_plot(node: "DataTree", axes: "Canvas" = None) -> Panels:
    """Draw the gain of each effect alone (left), and its score before the fit (right).

    Where no effect was fitted, there is no left side.
    """
    effects = node["effects"].to_dataset()
    gain, score = effects["gain"].to_numpy(), np.abs(effects["score"].to_numpy())
    # the last of these decides; NaN, which was not fitted or not tested, goes last
    order = np.lexsort((-np.nan_to_num(score), -np.nan_to_num(gain, nan=-np.inf)))
    names = [spoken(str(name)) for name in effects["effect"].to_numpy()[order]]
    states = [EffectStatus(str(status)) for status in effects["status"].to_numpy()[order]]
    # without a fitted effect there is no gain to show
    ratios = (3, 2) if np.isfinite(gain).any() else (1,)
    shape, size = (1, len(ratios)), (8.6, 0.26 * len(names) + 1.2)
    drawn = panels(axes, shape, size, sharey=True, width_ratios=ratios)
    left, right = drawn.grid[0, 0], drawn.grid[0, -1]
    if left is not right:
        _draw_gains(left, gain[order], states)
        add_legend(drawn, left, ncols=len(STATUS_GROUPS))
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
    """Size of the cosine between each two effects' signatures."""
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
    """Posterior of each coefficient, with its 90 % interval and what would be no effect."""
    drawn = panels(axes, (1, len(names)), (4.3 * max(len(names), 1) + 0.6, 3.0))
    for panel, name in zip(drawn.grid[0], names, strict=True):
        _draw_coefficient(panel, name, tree["posterior"][name].to_numpy().ravel())
    add_legend(drawn, drawn.grid[0, 0])
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
