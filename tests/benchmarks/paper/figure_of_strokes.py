"""How many strokes of the stirring are enough."""

import numpy as np
from matplotlib.axes import Axes
from xarray import Dataset

from bolfi_liquids.drawing import GREY, INK, PALETTE, new_figure, styled

from .figure import Drawn
from .figures_of_spillage import FEW_PERCENT, complete, interval
from .shared_simulations import SharedSimulations
from .truths import LIQUIDS

ENOUGH_SPILLED = (0.05, 0.01)  # spilled, on average over the liquids


def strokes(shared: SharedSimulations) -> Drawn:
    """Spilled percentage, and what is known of the viscosity, by the number of strokes."""
    study = complete(shared.strokes).squeeze("budget")
    study = study.rename(learned_by="strokes").assign_coords(strokes=list(shared.scale.strokes))
    spilled = study["spilled"].sel(rule="mean").transpose("truth", "strokes")
    drawn = study["concluded"].sel(parameter="viscosity").isel(draw=slice(1, None))
    width = np.log(drawn.transpose("truth", "strokes", "draw").to_numpy()).std(axis=-1)
    with styled():
        figure = new_figure(8.6, 3.6)
        left, right = figure.subplots(1, 2)
        _by_liquid(left, 100.0 * spilled.to_numpy(), study)
        left.axhline(100.0 * float(study["known"].mean()), color=GREY, ls=":", lw=1.0,
                     label="liquid known")  # fmt: skip
        left.set_yscale("symlog", linthresh=1.0)
        left.set_yticks(FEW_PERCENT, map(str, FEW_PERCENT))
        left.set(ylim=(0, None), ylabel="spilled [%]")
        _by_liquid(right, np.exp(width), study)
        right.set(ylim=(1, None), ylabel="posterior sd of the viscosity, a factor")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return Drawn(study, figure, _says(study, spilled.to_numpy(), shared.scale.few))


def _by_liquid(axes: Axes, values: np.ndarray, study: Dataset) -> None:
    """A line for each liquid, and the mean of all with its interval; values (truth, strokes)."""
    numbers = study["strokes"].to_numpy()
    for liquid, colour in zip(LIQUIDS, PALETTE, strict=False):
        own = values[study["liquid"].to_numpy() == liquid]
        if not len(own):
            continue
        axes.plot(numbers, own.mean(axis=0), ".-", color=colour, lw=0.8, label=liquid)
    means = values.mean(axis=0)
    ends = np.array([interval(column) for column in values.T])
    axes.errorbar(numbers, means, np.abs(ends.T - means), fmt="o-", color=INK, ms=4,
                  label="all, with 90 %", zorder=4)  # fmt: skip
    axes.set_xticks(numbers)
    axes.set_xlabel("strokes")


def _says(study: Dataset, spilled: np.ndarray, budget: int) -> str:
    numbers, means = study["strokes"].to_numpy(), spilled.mean(axis=0)
    told = ", ".join(f"{k}: {100 * mean:.2f}" for k, mean in zip(numbers, means, strict=True))
    lines = [f"spilled [%] after strokes, signal surrogate, N = {budget}, least expected: {told}"]
    for share in ENOUGH_SPILLED:
        # enough means that more strokes did not bring it above again
        more = np.maximum.accumulate(means[::-1])[::-1] < share
        first = f"{numbers[more][0]} strokes" if more.any() else "more strokes than these"
        lines.append(f"  under {100 * share:g} % from {first} on")
    return "\n".join(lines)
