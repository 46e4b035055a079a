"""The posterior over two parameters: contours, marginals and the prior."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..drawing import (
    BLUE,
    GREY,
    INK,
    ORANGE,
    Panels,
    hover_points,
    panels,
    plain_log_ticks,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset, DataTree

    from ..drawing import Canvas

AXIS_LABELS = {"viscosity": "viscosity [Pa s]", "cohesion": "cohesion [dimensionless]"}
LOGARITHMIC_PARAMETERS = ("viscosity",)

CONTOUR_SHARES = (0.9, 0.5)
"""Probability inside each contour."""


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


def _coordinate(surface: "Dataset", name: str) -> NDArray[np.float64]:
    """The axis as it is drawn: logarithms where it is logarithmic."""
    values = surface[name].to_numpy()
    return np.log(values) if name in LOGARITHMIC_PARAMETERS else values


def grid_density(
    surface: "Dataset", name: str = "log_posterior"
) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Density over the drawn coordinates, up to a constant, in the grid's shape; and these."""
    log_density = surface[name].to_numpy().copy()
    for axis, parameter in enumerate(surface[name].dims):
        if parameter in LOGARITHMIC_PARAMETERS:
            # Jacobian of the logarithm
            shape = [-1 if axis == at else 1 for at in range(log_density.ndim)]
            log_density = log_density + np.log(surface[parameter].to_numpy()).reshape(shape)
    coordinates = [_coordinate(surface, str(name)) for name in surface[name].dims]
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
