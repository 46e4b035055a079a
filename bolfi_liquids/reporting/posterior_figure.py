"""The posterior over two parameters: contours, marginals and the prior."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..drawing import (
    BLUE,
    GREY,
    INK,
    ORANGE,
    new_figure,
    plain_log_ticks,
    styled,
)
from .hover import Readout, marks, to_chart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset, DataTree

AXIS_LABELS = {"viscosity": "viscosity [Pa s]", "cohesion": "cohesion [dimensionless]"}
LOGARITHMIC_PARAMETERS = ("viscosity",)

CONTOUR_SHARES = (0.9, 0.5)
"""Probability inside each contour."""


def posterior_figure(tree: "DataTree") -> str:
    """Contours of the joint posterior with its marginals and those of the prior."""
    surface = tree["surface"].to_dataset()
    first, second = map(str, surface["log_posterior"].dims)
    posterior, coordinates = grid_density(surface)
    prior, _ = grid_density(surface, "log_prior")
    axes_of = dict(zip((first, second), coordinates, strict=True))
    with styled():
        figure = new_figure(6.2, 4.8)
        grid = figure.subplots(
            2,
            2,
            sharex="col",
            sharey="row",
            gridspec_kw={"width_ratios": (3, 1), "height_ratios": (1, 3)},
        )
        joint, top, right = grid[1, 0], grid[0, 0], grid[1, 1]
        grid[0, 1].set_axis_off()
        _draw_joint(joint, surface, posterior, axes_of)
        simulated = _mark(joint, tree, (first, second))
        for density, style in ((posterior, {"color": BLUE}), (prior, {"color": GREY, "ls": "--"})):
            top.plot(surface[first], marginal(density, *axes_of.values()), **style)
            right.plot(marginal(density.T, *reversed(axes_of.values())), surface[second], **style)
        _finish(figure, joint, (first, second))
        top.set_ylim(bottom=0)
        top.set_yticks([])
        right.set_xlim(left=0)
        right.set_xticks([])
        return to_chart(figure, "posterior", [simulated])


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


def _mark(joint: "Axes", tree: "DataTree", names: tuple[str, str]) -> Readout:
    simulations, closest = tree["simulations"], tree["closest"]
    x, y = (simulations[name].to_numpy() for name in names)
    joint.plot(x, y, ".", color=GREY, markersize=4, label="simulated")
    at = [closest[name].to_numpy() for name in names]
    joint.plot(*at, "*", color=ORANGE, markersize=10, label="closest hypothesis")
    texts = [
        f"simulation {number}: {names[0]} {first:.3g}, {names[1]} {second:.3g}"
        for number, (first, second) in enumerate(zip(x, y, strict=True), start=1)
    ]
    return marks(joint, x, y, texts, parameters=names)


def _finish(figure, joint: "Axes", names: tuple[str, str]) -> None:
    first, second = names
    for name, which in ((first, "x"), (second, "y")):
        if name in LOGARITHMIC_PARAMETERS:
            plain_log_ticks(joint, which)
    joint.set_xlabel(AXIS_LABELS.get(first, first))
    joint.set_ylabel(AXIS_LABELS.get(second, second))
    joint.plot([], [], color=BLUE, label="posterior, 50 % and 90 %")
    joint.plot([], [], color=GREY, linestyle="--", label="prior")
    figure.legend(loc="outside upper center", ncols=4)
    joint.tick_params(colors=INK)
