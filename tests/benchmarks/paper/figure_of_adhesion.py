"""What a liquid's sticking to its cup costs, and what criticism wins back."""

import numpy as np
from numpy.typing import NDArray
from xarray import Dataset

from bolfi_liquids.drawing import BLUE, GREY, ORANGE, PALETTE, new_figure, styled

from .figure import Drawn
from .figures_of_spillage import interval
from .shared_simulations import SharedSimulations
from .sticky import TRAINING

ADHESION_CASES = {
    "believed": ("the same pour if it did not stick", GREY),
    "before": ("chosen after stirring", ORANGE),
    "after": (f"chosen after stirring, {len(TRAINING)} pours and criticism", BLUE),
    "known": ("liquid and adhesion known", PALETTE[2]),
}


def adhesion(shared: SharedSimulations) -> Drawn:
    """Spilled by liquids like oil that stick to their cup."""
    found = shared.sticky
    truths = [one.truth for one in found]
    spilled = np.array([one.spilled for one in found])
    named = [one.named for one in found]
    with styled():
        figure = new_figure(6.4, 3.8)
        axes = figure.subplots()
        for place, (label, colour) in enumerate(ADHESION_CASES.values()):
            own = 100.0 * spilled[:, place]
            axes.bar(place, own.mean(), 0.7, color=colour, alpha=0.6, label=label)
            axes.plot(
                place + 0.08 * (np.arange(len(own)) - (len(own) - 1) / 2),
                own,
                ".",
                color=colour,
                ms=6,
            )
        axes.set_xticks([])
        axes.set_ylabel("spilled [%]")
        figure.legend(loc="outside lower center", ncols=2)
    data = Dataset(
        {"spilled": (("truth", "case"), spilled), "named": ("truth", named)},
        {
            "case": list(ADHESION_CASES),
            **{key: ("truth", [truth.theta[key] for truth in truths]) for key in truths[0].theta},
        },
    )
    return Drawn(data, figure, _says(100.0 * spilled, named))


def _says(percent: NDArray, named: list[str]) -> str:
    """Of percentages spilled (truths, cases)."""
    believed, before, after, known = percent.mean(axis=0)
    right = sum(names == "adhesion" for names in named)
    low, high = interval(percent[:, 1] - percent[:, 2])
    won = f"{before - after:.1f} points won back"
    won += f" (paired, 90 %: {low:.1f} to {high:.1f})" if len(percent) > 1 else ""
    won += f" of {before - known:.1f}; "
    return (
        f"spilled where the liquid sticks: {before:.1f} % by the pour chosen after stirring "
        f"({believed:.1f} % if it did not stick), {after:.1f} % by the one chosen after criticism, "
        f"{known:.1f} % with all known: {won}adhesion named alone in {right} of {len(named)}"
    )
