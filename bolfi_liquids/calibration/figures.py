"""Figures of a calibration: the fit in time and by stroke, the posterior, the search."""

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

CONTOUR_SHARES = (0.9, 0.5)
"""Probability inside each contour."""

POSTERIOR_INTERVAL = 0.05, 0.95
"""Quantiles of the posterior between which the panels of the search are shaded."""


def draw_fit(tree: "DataTree", axes: "Canvas" = None) -> Panels:
    """Inclination against time: recorded, closest hypothesis and posterior prediction.

    One row of axes for each recording, one column for each plane.

    Args:
        tree: posterior.nc.
        axes: Where to draw, see `drawing.panels`.
    """
    members = _by_recording(tree, "recorded", "closest", "posterior_predictive")
    size = 8.6, 2.6 * len(members) + 0.4
    drawn = panels(axes, (len(members), 2), size, sharex="row", sharey=True)
    for row, parts in zip(drawn.grid, members, strict=True):
        for axis, plane in zip(row, parts["recorded"]["plane"].to_numpy(), strict=True):
            _draw_inclination(axis, {name: one.sel(plane=plane) for name, one in parts.items()})
            axis.set_title(f"{plane} plane", loc="left")
        row[0].set_ylabel("inclination [deg]")
    for axis in drawn.grid[-1]:
        axis.set_xlabel("time [s]")
    drawn.legend(*drawn.grid[0, 0].get_legend_handles_labels())
    return drawn


def _by_recording(tree: "DataTree", *groups: str) -> list[dict[str, "Dataset"]]:
    """Groups of posterior.nc by name, for each recording."""
    member = tree["recorded"]["recording"].to_numpy()
    return [
        {name: tree[name].to_dataset().isel(frame=np.flatnonzero(member == one)) for name in groups}
        for one in np.unique(member)
    ]


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
    members = _by_recording(tree, "recorded", "posterior_predictive")
    drawn = panels(axes, (len(members), 1), (8.6, 2.2 * len(members) + 0.4))
    for axis, parts in zip(drawn.grid[:, 0], members, strict=True):
        _draw_strokes(axis, parts["recorded"], parts["posterior_predictive"])
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


def draw_posterior(tree: "DataTree", ax: "Canvas" = None) -> Panels:
    """Contours of the joint posterior, in a figure of its own with marginals and the prior's.

    Args:
        tree: posterior.nc.
        ax: Where to draw the contours alone; None or an empty figure: the marginals, too.
    """
    from matplotlib.figure import Figure

    surface = tree["surface"].to_dataset()
    first, second = map(str, surface["log_posterior"].dims)
    posterior, coordinates = grid_density(surface)
    axes_of = dict(zip((first, second), coordinates, strict=True))
    if ax is None or isinstance(ax, Figure):
        ratios = {"width_ratios": (3, 1), "height_ratios": (1, 3)}
        drawn = panels(ax, (2, 2), (6.2, 4.8), sharex="col", sharey="row", gridspec_kw=ratios)
        _draw_marginals(drawn, surface, posterior, axes_of)
    else:
        drawn = panels(ax, (1, 1), (4.6, 3.6))
    joint = drawn.grid[-1, 0]
    _draw_joint(joint, surface, posterior, axes_of)
    _mark(joint, tree, (first, second))
    _finish(drawn, joint, (first, second))
    return drawn


def _draw_marginals(
    drawn: Panels, surface: "Dataset", posterior: NDArray, axes_of: dict[str, NDArray]
) -> None:
    first, second = axes_of
    top, right = drawn.grid[0, 0], drawn.grid[1, 1]
    drawn.grid[0, 1].set_axis_off()
    prior, _ = grid_density(surface, "log_prior")
    for density, style in ((posterior, {"color": BLUE}), (prior, {"color": GREY, "ls": "--"})):
        top.plot(surface[first], marginal(density, *axes_of.values()), **style)
        right.plot(marginal(density.T, *reversed(axes_of.values())), surface[second], **style)
    top.set_ylim(bottom=0)
    top.set_yticks([])
    right.set_xlim(left=0)
    right.set_xticks([])


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


def _draw_joint(
    joint: "Axes", surface: "Dataset", density: NDArray, axes_of: dict[str, NDArray]
) -> None:
    first, second = axes_of
    cells = np.outer(np.gradient(axes_of[first]), np.gradient(axes_of[second]))
    levels = contour_levels(density * cells, density)
    x, y = surface[first], surface[second]
    joint.contourf(x, y, density.T, levels=[*levels, np.inf], colors=[BLUE, BLUE], alpha=0.25)
    joint.contour(x, y, density.T, levels=levels, colors=BLUE, linewidths=1.0)


def _mark(joint: "Axes", tree: "DataTree", names: tuple[str, str]) -> None:
    simulations, closest = tree["simulations"], tree["closest"]
    x, y = (simulations[name].to_numpy() for name in names)
    joint.plot(x, y, ".", color=GREY, markersize=4, label="simulated")
    at = [closest[name].to_numpy() for name in names]
    joint.plot(*at, "*", color=ORANGE, markersize=10, label="closest hypothesis")
    texts = [
        f"simulation {number}: {names[0]} {first:.3g}, {names[1]} {second:.3g}"
        for number, (first, second) in enumerate(zip(x, y, strict=True), start=1)
    ]
    hover_points(joint, x, y, texts)


def _finish(drawn: Panels, joint: "Axes", names: tuple[str, str]) -> None:
    first, second = names
    for name, which in ((first, "x"), (second, "y")):
        if name in LOGARITHMIC_PARAMETERS:
            plain_log_ticks(joint, which)
    joint.set_xlabel(AXIS_LABELS.get(first, first))
    joint.set_ylabel(AXIS_LABELS.get(second, second))
    joint.plot([], [], color=BLUE, label="posterior, 50 % and 90 %")
    if drawn.own:
        joint.plot([], [], color=GREY, linestyle="--", label="prior")
    drawn.legend(*joint.get_legend_handles_labels(), ncols=4)
    joint.tick_params(colors=INK)


def draw_search(tree: "DataTree", axes: "Canvas" = None) -> Panels:
    """Discrepancy of each simulation in turn with the least so far, and below it the parameters
    that it tried, before the posterior; the start design is hollow.

    Args:
        tree: posterior.nc.
        axes: Where to draw, see `drawing.panels`; one for the discrepancy and one for each
            parameter.
    """
    from matplotlib.ticker import MaxNLocator

    simulations = tree["simulations"].to_dataset()
    # effects that were added to the posterior later were not searched for
    names = [str(name) for name in tree["posterior"].data_vars if name in simulations]
    discrepancy = np.degrees(np.degrees(simulations["discrepancy"].to_numpy()))
    iteration = np.arange(1, len(discrepancy) + 1)
    start = iteration <= int(tree.attrs["initial"])
    texts = _texts(names, simulations, discrepancy)
    size, ratios = (6.4, 2.6 + 1.5 * len(names)), [1.5] + [1.0] * len(names)
    drawn = panels(axes, (1 + len(names), 1), size, sharex=True, height_ratios=ratios)
    first, *others = drawn.grid[:, 0]
    least = np.fmin.accumulate(discrepancy)
    first.step(iteration, least, where="post", color=GREY, linewidth=1.0, label="least so far")
    _dots(first, iteration, discrepancy, start, texts)
    plain_log_ticks(first, "y")
    first.set_ylabel("discrepancy [deg² s]")
    for axis, name in zip(others, names, strict=True):
        low, high = np.quantile(tree["posterior"][name].to_numpy(), POSTERIOR_INTERVAL)
        axis.axhspan(low, high, color=BLUE, alpha=0.15, linewidth=0, label="posterior, 90 %")
        _dots(axis, iteration, simulations[name].to_numpy(), start, texts)
        axis.set_ylabel(AXIS_LABELS.get(name, name))
        if name in LOGARITHMIC_PARAMETERS:
            plain_log_ticks(axis, "y")
    others[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    others[-1].set_xlabel("simulation")
    handles, labels = first.get_legend_handles_labels()
    more, more_labels = others[0].get_legend_handles_labels()
    drawn.legend([*handles, more[0]], [*labels, more_labels[0]], ncols=4)
    return drawn


def _texts(names: list[str], simulations: "Dataset", discrepancy: NDArray) -> list[str]:
    """Parameters and discrepancy of each simulation."""
    tried = [simulations[name].to_numpy() for name in names]
    return [
        f"simulation {at + 1}: "
        + ", ".join(
            f"{name} {with_unit(name, values[at])}"
            for name, values in zip(names, tried, strict=True)
        )
        + (f"; discrepancy {off:.3g} deg² s" if np.isfinite(off) else "; failed")
        for at, off in enumerate(discrepancy)
    ]


def _dots(
    axes: "Axes", iteration: NDArray, values: NDArray, start: NDArray, texts: list[str]
) -> None:
    for chosen, face, label in (
        (start, "white", "start design"),
        (~start, BLUE, "engine's choice"),
    ):
        axes.plot(
            iteration[chosen],
            values[chosen],
            "o",
            markersize=5,
            color=BLUE,
            markerfacecolor=face,
            label=label,
        )
    hover_points(axes, iteration, values, texts)
