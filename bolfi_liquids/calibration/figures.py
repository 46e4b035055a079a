"""Figures of a calibration: the fit in time and by stroke, the posterior, the search.

Each takes posterior.nc and where to draw, see `drawing.panels`. What a criticism draws, too, is
drawn by `draw_angles` and `draw_bars`.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..drawing import (
    BLUE,
    GREY,
    INK,
    ORANGE,
    Panels,
    hover,
    hover_points,
    hover_strips,
    panels,
    plain_log_ticks,
)
from ..wording import with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset, DataTree

    from ..drawing import Canvas

PLANE_COLOURS = (BLUE, ORANGE)
AXIS_LABELS = {"viscosity": "viscosity [Pa s]", "cohesion": "cohesion [dimensionless]"}
LOGARITHMIC_PARAMETERS = ("viscosity",)
BAR_WIDTH = 0.8  # of all bars at one place

CONTOUR_SHARES = (0.9, 0.5)
"""Probability inside each contour."""

POSTERIOR_INTERVAL = 0.05, 0.95
"""Quantiles of the posterior between which the panels of the search are shaded."""


def draw_fit(tree: "DataTree", axes: "Canvas" = None) -> Panels:
    """Inclination against time: recorded, closest hypothesis and posterior prediction; a row for
    each recording, a column for each plane."""
    members = _by_recording(tree, "recorded", "closest", "posterior_predictive")
    size = 8.6, 2.6 * len(members) + 0.4
    drawn = panels(axes, (len(members), 2), size, sharex="row", sharey=True)
    for row, parts in zip(drawn.grid, members, strict=True):
        time = parts["recorded"]["time"].to_numpy()
        for axis, plane in zip(row, parts["recorded"]["plane"].to_numpy(), strict=True):
            recorded, closest, predicted = (
                np.degrees(one["inclination"].sel(plane=plane).to_numpy()) for one in parts.values()
            )
            draws = predicted.reshape(-1, len(time))
            lines = {"closest hypothesis": (ORANGE, closest), "recorded": (INK, recorded)}
            band = f"range of {len(draws)} posterior predictions"
            draw_angles(axis, time, lines, {band: (BLUE, draws.min(axis=0), draws.max(axis=0))})
            axis.set_title(f"{plane} plane", loc="left")
        row[0].set_ylabel("inclination [deg]")
    for axis in drawn.grid[-1]:
        axis.set_xlabel("time [s]")
    add_legend(drawn, drawn.grid[0, 0])
    return drawn


def _by_recording(tree: "DataTree", *groups: str) -> list[dict[str, "Dataset"]]:
    """Groups of posterior.nc by name, for each recording."""
    member = tree["recorded"]["recording"].to_numpy()
    return [
        {name: tree[name].to_dataset().isel(frame=np.flatnonzero(member == one)) for name in groups}
        for one in np.unique(member)
    ]


def draw_angles(
    axes: "Axes",
    time: NDArray,
    lines: Mapping[str, tuple[str, NDArray]],
    band: Mapping[str, tuple[str, NDArray, NDArray]],
) -> None:
    """Angles [deg] against time (T,) [s].

    Args:
        axes: Where to draw.
        time: Of the samples.
        lines: Label -> colour and angles (T,); the last is on top.
        band: Label -> colour, and the lower and upper end (T,), of what is shaded.
    """
    for label, (colour, low, high) in band.items():
        axes.fill_between(time, low, high, color=colour, alpha=0.25, linewidth=0, label=label)
    for label, (colour, angles) in lines.items():
        axes.plot(time, angles, color=colour, linewidth=1.1, label=label)
    axes.axhline(0.0, color=GREY, linewidth=0.8, zorder=0)

    def text_at(at: int) -> str:
        shown = [f"{name} {angles[at]:.2f}°" for name, (_, angles) in reversed([*lines.items()])]
        ends = [
            f"{name} {low[at]:.2f}° to {high[at]:.2f}°" for name, (_, low, high) in band.items()
        ]
        return f"{time[at]:.2f} s: {', '.join(shown + ends)}"

    hover_strips(axes, time, text_at)


def draw_strokes(tree: "DataTree", axes: "Canvas" = None) -> Panels:
    """RMS of recorded less predicted inclination by stroke and plane, a row for each recording;
    beside it the sd of the predictions."""
    members = _by_recording(tree, "recorded", "posterior_predictive")
    drawn = panels(axes, (len(members), 1), (8.6, 2.2 * len(members) + 0.4))
    for axis, parts in zip(drawn.grid[:, 0], members, strict=True):
        recorded, predicted = parts.values()
        numbers = recorded["stroke"].to_numpy()
        strokes = [str(number) for number in np.unique(numbers)]
        seen = np.degrees(recorded["inclination"].to_numpy())
        shown = np.degrees(predicted["inclination"].to_numpy()).reshape(-1, *seen.shape)
        left, planes = seen - shown.mean(axis=0), recorded["plane"].to_numpy()
        heights = {
            f"{plane} plane": (colour, rms_by(numbers, left[:, at]))
            for at, (plane, colour) in enumerate(zip(planes, PLANE_COLOURS, strict=True))
        }
        draw_bars(axis, strokes, heights)
        usual = np.pad(rms_by(numbers, shown.std(axis=0, ddof=1)), 1, mode="edge")
        places, label = np.arange(-1, len(strokes) + 1), "sd of the predictions"
        axis.step(places, usual, where="mid", color=INK, lw=1.0, label=label)
        axis.set_xlim(-0.6, len(strokes) - 0.4)
        axis.set_ylabel("RMS [deg]")
    drawn.grid[-1, 0].set_xlabel("stroke")
    add_legend(drawn, drawn.grid[0, 0])
    return drawn


def draw_bars(
    axes: "Axes", ticks: Sequence[str], heights: Mapping[str, tuple[str, NDArray]]
) -> NDArray:
    """Bars side by side at each of n places.

    Args:
        axes: Where to draw.
        ticks: Names of the places.
        heights: Label -> colour and heights (n,) [deg].

    Returns:
        Middles of the first bars (n,).
    """
    width = BAR_WIDTH / len(heights)
    first = np.arange(len(ticks)) - (BAR_WIDTH - width) / 2.0
    for k, (label, (colour, high)) in enumerate(heights.items()):
        bars = axes.bar(first + k * width, high, 0.9 * width, color=colour, label=label)
        for bar, tick, height in zip(bars, ticks, high, strict=True):
            hover(bar, f"{tick}, {label}: {height:.2f}°")
    axes.set_xticks(range(len(ticks)), ticks)
    return first


def rms_by(numbers: NDArray, values: NDArray) -> NDArray[np.float64]:
    """RMS of values (T,) or (T, planes) in each group of equal numbers (T,)."""
    groups = [values[numbers == number] for number in np.unique(numbers)]
    seen = [group[np.isfinite(group)] for group in groups]  # none where all samples are missing
    return np.array([np.sqrt(np.mean(part**2)) if part.size else np.nan for part in seen])


def add_legend(drawn: Panels, *axes: "Axes", ncols: int = 3) -> None:
    """The legend of a plot: what these axes label, each label once."""
    entries: dict[str, object] = {}
    for one in axes:
        handles, labels = one.get_legend_handles_labels()
        entries |= dict(zip(labels, handles, strict=True))
    drawn.legend(list(entries.values()), list(entries), ncols=ncols)


def draw_posterior(tree: "DataTree", ax: "Canvas" = None) -> Panels:
    """Contours of the joint posterior in the axes that are given; in a figure of its own with the
    marginals, the prior's, too."""
    from matplotlib.figure import Figure

    surface = tree["surface"].to_dataset()
    names = [str(name) for name in surface["log_posterior"].dims]
    density, (first, second) = grid_density(surface)
    if ax is None or isinstance(ax, Figure):
        ratios = {"width_ratios": (3, 1), "height_ratios": (1, 3)}
        drawn = panels(ax, (2, 2), (6.2, 4.8), sharex="col", sharey="row", gridspec_kw=ratios)
        top, right = drawn.grid[0, 0], drawn.grid[1, 1]
        drawn.grid[0, 1].set_axis_off()
        prior, _ = grid_density(surface, "log_prior")
        for of, style in ((density, {"color": BLUE}), (prior, {"color": GREY, "ls": "--"})):
            top.plot(surface[names[0]], marginal(of, first, second), **style)
            right.plot(marginal(of.T, second, first), surface[names[1]], **style)
        top.set_ylim(bottom=0)
        top.set_yticks([])
        right.set_xlim(left=0)
        right.set_xticks([])
    else:
        drawn = panels(ax, (1, 1), (4.6, 3.6))
    joint = drawn.grid[-1, 0]
    cells = np.outer(np.gradient(first), np.gradient(second))
    levels, on = contour_levels(density * cells, density), [surface[name] for name in names]
    joint.contourf(*on, density.T, levels=[*levels, np.inf], colors=[BLUE, BLUE], alpha=0.25)
    joint.contour(*on, density.T, levels=levels, colors=BLUE, linewidths=1.0)
    _mark_simulations(joint, tree, names)
    for name, which in zip(names, "xy", strict=True):
        if name in LOGARITHMIC_PARAMETERS:
            plain_log_ticks(joint, which)
    joint.set_xlabel(AXIS_LABELS.get(names[0], names[0]))
    joint.set_ylabel(AXIS_LABELS.get(names[1], names[1]))
    joint.plot([], [], color=BLUE, label="posterior, 50 % and 90 %")
    if drawn.own:
        joint.plot([], [], color=GREY, linestyle="--", label="prior")
    add_legend(drawn, joint, ncols=4)
    return drawn


def _mark_simulations(joint: "Axes", tree: "DataTree", names: Sequence[str]) -> None:
    """Mark where the search simulated, and the closest simulation."""
    x, y = (tree["simulations"][name].to_numpy() for name in names)
    joint.plot(x, y, ".", color=GREY, markersize=4, label="simulated")
    at = [tree["closest"][name].to_numpy() for name in names]
    joint.plot(*at, "*", color=ORANGE, markersize=10, label="closest hypothesis")
    hover_points(joint, x, y, _simulation_texts({names[0]: x, names[1]: y}))


def grid_density(
    surface: "Dataset", name: str = "log_posterior"
) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Density on a grid, and its coordinates; of a logarithmic parameter those are logarithms.

    Returns:
        Density over the coordinates, up to a constant, in the grid's shape; coordinates by axis.
    """
    log_density = surface[name].to_numpy()
    coordinates = []
    for axis, parameter in enumerate(surface[name].dims):
        values = surface[parameter].to_numpy()
        if parameter in LOGARITHMIC_PARAMETERS:
            values = np.log(values)
            # Jacobian of the logarithm
            shape = [-1 if axis == at else 1 for at in range(log_density.ndim)]
            log_density = log_density + values.reshape(shape)
        coordinates.append(values)
    return np.exp(log_density - log_density.max()), coordinates


def marginal(density: NDArray, kept: NDArray, integrated: NDArray) -> NDArray[np.float64]:
    """Marginal density over a grid's first axis.

    Args:
        density: Up to a constant, shape (len(kept), len(integrated)).
        kept: Coordinate of the first axis.
        integrated: Coordinate of the second.
    """
    unscaled = np.trapezoid(density, integrated, axis=1)
    return unscaled / np.trapezoid(unscaled, kept)


def contour_levels(mass: NDArray, density: NDArray) -> list[float]:
    """Densities above which the shares `CONTOUR_SHARES` of the probability lie, ascending.

    Args:
        mass: Probability of each cell of the grid, up to a constant.
        density: At the cells, of the same shape.
    """
    order = np.argsort(-density, axis=None)
    inside = np.cumsum(mass.ravel()[order]) / mass.sum()
    ranked = density.ravel()[order]
    return [float(ranked[np.searchsorted(inside, share)]) for share in CONTOUR_SHARES]


def draw_search(tree: "DataTree", axes: "Canvas" = None) -> Panels:
    """Discrepancy of each simulation in turn with the least so far, and below it the parameters
    that it tried, before the posterior; the start design is hollow."""
    from matplotlib.ticker import MaxNLocator

    simulations = tree["simulations"].to_dataset()
    # effects that were added to the posterior later were not searched for
    names = [str(name) for name in tree["posterior"].data_vars if name in simulations]
    discrepancy = np.degrees(np.degrees(simulations["discrepancy"].to_numpy()))
    iteration = np.arange(1, len(discrepancy) + 1)
    start = iteration <= int(tree.attrs["initial"])
    tried = {name: simulations[name].to_numpy() for name in names}
    texts = [
        text + (f"; discrepancy {off:.3g} deg² s" if np.isfinite(off) else "; failed")
        for text, off in zip(_simulation_texts(tried), discrepancy, strict=True)
    ]

    def dots(axis: "Axes", values: NDArray) -> None:
        for at, face, label in (
            (start, "white", "start design"),
            (~start, BLUE, "engine's choice"),
        ):
            style = {"ms": 5, "color": BLUE, "markerfacecolor": face, "label": label}
            axis.plot(iteration[at], values[at], "o", **style)
        hover_points(axis, iteration, values, texts)

    size, ratios = (6.4, 2.6 + 1.5 * len(names)), [1.5] + [1.0] * len(names)
    drawn = panels(axes, (1 + len(names), 1), size, sharex=True, height_ratios=ratios)
    first, *others = drawn.grid[:, 0]
    least = np.fmin.accumulate(discrepancy)
    first.step(iteration, least, where="post", color=GREY, linewidth=1.0, label="least so far")
    dots(first, discrepancy)
    plain_log_ticks(first, "y")
    first.set_ylabel("discrepancy [deg² s]")
    for axis, (name, values) in zip(others, tried.items(), strict=True):
        low, high = np.quantile(tree["posterior"][name].to_numpy(), POSTERIOR_INTERVAL)
        axis.axhspan(low, high, color=BLUE, alpha=0.15, linewidth=0, label="posterior, 90 %")
        dots(axis, values)
        axis.set_ylabel(AXIS_LABELS.get(name, name))
        if name in LOGARITHMIC_PARAMETERS:
            plain_log_ticks(axis, "y")
    others[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    others[-1].set_xlabel("simulation")
    add_legend(drawn, first, others[0], ncols=4)
    return drawn


def _simulation_texts(tried: Mapping[str, NDArray]) -> list[str]:
    """Number and parameters of each of n simulations; `tried` has them by name, (n,)."""
    rows: Iterable[tuple[float, ...]] = zip(*tried.values(), strict=True)
    return [
        f"simulation {number}: "
        + ", ".join(f"{name} {with_unit(name, of)}" for name, of in zip(tried, row, strict=True))
        for number, row in enumerate(rows, start=1)
    ]
