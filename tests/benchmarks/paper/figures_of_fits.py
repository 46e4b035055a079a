"""The paper's figure 2, left and middle: the closest hypothesis, and what stirring teaches."""

from typing import cast

import numpy as np
from xarray import Dataset, concat

from bolfi_liquids.calibration.figures import AXIS_LABELS, contour_levels, grid_density
from bolfi_liquids.drawing import (
    GREY,
    INK,
    LIGHT,
    ORANGE,
    PALETTE,
    new_figure,
    plain_log_ticks,
    styled,
)
from bolfi_liquids.inputs.bundled import RECORDED_LIQUIDS

from .figure import Drawn
from .shared_simulations import SharedSimulations


def inclination(shared: SharedSimulations) -> Drawn:
    """Inclination against time with the closest hypothesis; the discrepancy is what is shaded."""
    budget = shared.scale.recorded[-1]
    tree = shared.calibration("water", budget, "discrepancy").tree
    recorded, closest = (tree[name]["inclination"] for name in ("recorded", "closest"))
    time = tree["recorded"]["time"].to_numpy()
    with styled():
        figure = new_figure(8.6, 3.2)
        for axes, plane in zip(
            figure.subplots(1, 2, sharey=True), recorded["plane"].to_numpy(), strict=True
        ):
            seen, shown = (
                np.degrees(one.sel(plane=plane).to_numpy()) for one in (recorded, closest)
            )
            axes.fill_between(time, seen, shown, color=ORANGE, alpha=0.35, lw=0, label="difference")
            axes.plot(time, seen, color=INK, lw=1.0, label="recorded")
            axes.plot(time, shown, color=ORANGE, lw=1.0, label="closest hypothesis")
            axes.axhline(0.0, color=LIGHT, lw=0.8, zorder=0)
            axes.set(xlabel="time [s]", title=f"{plane} plane")
            axes.title.set_position((0.0, 1.0))
        figure.axes[0].set_ylabel("inclination [deg]")
        figure.legend(
            *figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3
        )
    rms = float(np.degrees(np.sqrt(((recorded - closest) ** 2).mean())))
    data = Dataset({"recorded": recorded, "closest": closest}, {"time": ("frame", time)})
    return Drawn(data, figure, f"water, N = {budget}: closest hypothesis {rms:.2f} deg RMS away")


def posterior(shared: SharedSimulations) -> Drawn:
    """Contours of the posteriors of the recorded liquids, one panel for each surrogate."""
    budget, surrogates = shared.scale.recorded[-1], shared.scale.surrogates
    kept = []
    with styled():
        figure = new_figure(4.6 * len(surrogates), 3.9)
        panels = figure.subplots(1, len(surrogates), sharey=True, squeeze=False)[0]
        for axes, surrogate in zip(panels, surrogates, strict=True):
            found = []
            for liquid, colour in zip(RECORDED_LIQUIDS, PALETTE, strict=False):
                tree = shared.calibration(liquid, budget, surrogate).tree
                _contours(axes, tree["surface"].to_dataset(), liquid, colour)
                found.append(tree["surface"].to_dataset().assign_coords(liquid=liquid))
            axes.set(xlabel=AXIS_LABELS["viscosity"], title=f"{surrogate}, N = {budget}")
            plain_log_ticks(axes, "x")
            kept.append(concat(found, "liquid", join="outer").assign_coords(surrogate=surrogate))
        panels[0].set_ylabel(AXIS_LABELS["cohesion"])
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    data = cast(Dataset, concat(kept, "surrogate", join="outer"))
    return Drawn(
        data, figure, f"posteriors of {', '.join(RECORDED_LIQUIDS)} after {budget} simulations"
    )


def _contours(axes, surface: Dataset, liquid: str, colour: str) -> None:
    density, coordinates = grid_density(surface)
    cells = np.outer(*(np.gradient(values) for values in coordinates))
    levels = contour_levels(density * cells, density)
    x, y = surface["viscosity"], surface["cohesion"]
    axes.contourf(x, y, density.T, levels=[*levels, np.inf], colors=[colour] * 2, alpha=0.3)
    axes.contour(x, y, density.T, levels=levels, colors=colour, linewidths=1.0)
    axes.plot([], [], color=colour, label=liquid)
    axes.tick_params(colors=INK)
    axes.axvline(float(surface["viscosity"][0]), color=GREY, lw=0.5)
