"""From recordings of the independent solver to what it spilled itself."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from ..bundled import POURED, bundled_pours
from ..drawing import GREY, INK, PALETTE, new_figure, styled
from ..pour_results import read_pour
from ..pouring import choose_pour
from ..prior import default_prior
from ..spillage import Surface
from .decisions import decide_unknowing
from .figure import Drawn
from .workshop import Workshop

if TYPE_CHECKING:
    from ..pour_table import PourTable


def between(table: "PourTable", rate: float, distance: float) -> tuple[float, float]:
    """What the table spilled between its actions, and what that misses.

    Along the distance by monotone cubics (Fritsch and Carlson 1980), since the best distance lies
    in a valley, which chords between rows of the table cut off: they miss more, and nearly always
    upwards. Linear in the logarithm of the angular velocity. The error is the RMS over pours
    that are left out in turn and have a neighbour on either side. Beyond the table its edge is
    taken.

    Returns:
        Spilled fraction, and its error.
    """
    spilled = table.fractions[:, 0]
    rates = np.unique(table.angular_velocity)
    rows = [np.flatnonzero(table.angular_velocity == one) for one in rates]
    rows = [row[np.argsort(table.distance[row])] for row in rows]

    def along(row: NDArray, at: float) -> float:
        """Of the pours `row`, all of one angular velocity."""
        known = table.distance[row]
        return float(PchipInterpolator(known, spilled[row])(np.clip(at, known[0], known[-1])))

    value = np.interp(np.log(rate), np.log(rates), [along(row, distance) for row in rows])
    missed = [
        along(row[row != left], table.distance[left]) - spilled[left]
        for row in rows
        for left in row[1:-1]
    ]
    return float(value), float(np.sqrt(np.mean(np.square(missed))))


def _least(run: Path, risk: str) -> dict[str, float]:
    """The action at which another measure of risk is least, over the draws tried everywhere."""
    actions = read_pour(run)["actions"]
    return Surface(*(actions[name].to_numpy() for name in Surface._fields)).least(risk)


def recordings(workshop: Workshop) -> Drawn:
    """Chosen from a recording of stirring alone, spilled by the other solver."""
    from xarray import Dataset

    scale = workshop.scale
    action = decide_unknowing(workshop.grid, default_prior(), scale.seed)
    unknowing = action["angular_velocity"], action["distance"]
    columns = [(n, s) for s in scale.surrogates for n in scale.recorded]
    shape = len(POURED), len(columns)
    spilled, plug_in, cautious = np.empty(shape), np.empty(shape), np.empty(shape)
    best, blind = [], []
    lines = ["spilled by the other solver [%], its table interpolated:"]
    for row, liquid in enumerate(POURED):
        table = bundled_pours(liquid)
        least = int(np.argmin(table.fractions[:, 0]))
        best.append(float(table.fractions[least, 0]))
        blind.append(between(table, *unknowing)[0])
        for column, (budget, surrogate) in enumerate(columns):
            pour = choose_pour(
                workshop.calibration(liquid, budget, surrogate),
                iterations=scale.rates,
                seed=scale.seed,
                progress=workshop.progress,
            )
            spilled[row, column], error = between(
                table, pour.chosen.angular_velocity, pour.chosen.distance
            )
            plug_in[row, column], _ = between(
                table, pour.plug_in.angular_velocity, pour.plug_in.distance
            )
            worst = _least(pour.path, "cvar")
            cautious[row, column], _ = between(table, worst["angular_velocity"], worst["distance"])
            lines.append(
                f"  {liquid}, N = {budget}, {surrogate}: {100 * spilled[row, column]:.1f} "
                f"(error of interpolation {100 * error:.1f}) at "
                f"{np.degrees(pour.chosen.angular_velocity):.0f} deg/s, "
                f"{100 * pour.chosen.distance:.1f} cm; at theta* alone "
                f"{100 * plug_in[row, column]:.1f}, by CVaR {100 * cautious[row, column]:.1f}; "
                f"table's best {100 * best[-1]:.1f}; "
                f"liquid unknown {100 * blind[-1]:.1f}"
            )
    labels = [f"{s}, N = {n}" for n, s in columns]
    with styled():
        figure = new_figure(7.4, 3.8)
        axes = figure.subplots()
        width = 0.8 / (len(columns) + 2)
        bars = [
            ("table's best", np.array(best), GREY),
            ("liquid unknown", np.array(blind), "#c9cfd6"),
        ]
        bars += [(f"chosen, {label}", spilled[:, n], PALETTE[n]) for n, label in enumerate(labels)]
        for at, (label, values, colour) in enumerate(bars):
            x = np.arange(len(POURED)) + width * (at - (len(bars) - 1) / 2)
            axes.bar(x, 100 * values, 0.9 * width, color=colour, label=label)
            if at >= 2:
                axes.plot(x, 100 * plug_in[:, at - 2], "x", color=INK, ms=5,
                          label="best at θ* alone" if at == 2 else None)  # fmt: skip
                axes.plot(x, 100 * cautious[:, at - 2], "^", color=INK, mfc="none", ms=5,
                          label="by CVaR" if at == 2 else None)  # fmt: skip
        axes.set_xticks(range(len(POURED)), POURED)
        axes.set_ylabel("spilled in the other solver [%]")
        figure.legend(loc="outside lower center", ncols=3)
    dims = ("liquid", "run")
    data = Dataset(
        {
            "spilled": (dims, spilled),
            "plug_in": (dims, plug_in),
            "cvar": (dims, cautious),
            "best": ("liquid", best),
            "unknown": ("liquid", blind),
        },
        {"liquid": list(POURED), "run": labels},
    )
    return Drawn(data, figure, "\n".join(lines))
