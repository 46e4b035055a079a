"""From recordings of stirs to what the chosen pours spill in the reference solver."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from xarray import DataArray, Dataset

from bolfi_liquids.drawing import GREY, INK, PALETTE, new_figure, styled
from bolfi_liquids.inputs.bundled import POURED_LIQUIDS, bundled_pours
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.pouring.choose import choose_pour
from bolfi_liquids.pouring.result import Pour
from bolfi_liquids.pouring.spillage import ACTION, Surface

from .decisions import RULES, Action, decide_unknowing
from .figure import Drawn
from .shared_simulations import SharedSimulations
from .table_interpolation import between

OTHER_CHOICES = {
    "plug_in": ("x", "best at θ* alone"),
    "cvar": ("^", "least CVaR of the draws"),
}
"""Rules beside the least expected spillage -> marker and label."""


def recordings(shared: SharedSimulations) -> Drawn:
    """Chosen from a recording of stirring alone, spilled in the reference solver."""
    data = _judged(shared)
    return Drawn(data, _figure(data), _says(data))


def _judged(shared: SharedSimulations) -> Dataset:
    scale = shared.scale
    runs = [(surrogate, n) for surrogate in scale.surrogates for n in scale.recorded]
    shape = len(POURED_LIQUIDS), len(runs), len(RULES)
    spilled, error, rates, distances = (np.empty(shape) for _ in range(4))
    unknowing = decide_unknowing(shared.landing_map, default_prior(), scale.seed)
    best, unknown = np.empty(len(POURED_LIQUIDS)), np.empty((len(POURED_LIQUIDS), 2))
    for row, liquid in enumerate(POURED_LIQUIDS):
        table = bundled_pours(liquid)
        best[row] = table.fractions[:, 0].min()
        unknown[row] = between(table, *(unknowing[name] for name in ACTION))
        for column, (surrogate, budget) in enumerate(runs):
            actions = _chosen(shared, liquid, budget, surrogate)
            for at, rule in enumerate(RULES):
                rate, distance = (actions[rule][name] for name in ACTION)
                place = row, column, at
                spilled[place], error[place] = between(table, rate, distance)
                rates[place], distances[place] = rate, distance
    dims = ("liquid", "run", "rule")
    return Dataset(
        {
            "spilled": (dims, spilled),
            "error": (dims, error),
            "angular_velocity": (dims, rates, {"units": "rad s-1"}),
            "distance": (dims, distances, {"units": "m"}),
            "best": ("liquid", best),
            "unknown": ("liquid", unknown[:, 0]),
            "unknown_error": ("liquid", unknown[:, 1]),
        },
        {
            "liquid": list(POURED_LIQUIDS),
            "run": [f"{surrogate}, N = {n}" for surrogate, n in runs],
            "rule": list(RULES),
        },
    )


def _chosen(
    shared: SharedSimulations, liquid: str, budget: int, surrogate: str
) -> dict[str, Action]:
    """By the rules of `RULES`."""
    scale = shared.scale
    pour = choose_pour(
        shared.calibration(liquid, budget, surrogate),
        iterations=scale.rates,
        seed=scale.seed,
        force=True,  # the choice over a bad fit is judged, too
        executor=shared.executor,
    )
    return {
        "plug_in": pour.plug_in.action,
        "mean": pour.chosen.action,
        "cvar": _least(pour, "cvar"),
    }


def _least(pour: Pour, risk: str) -> dict[str, float]:
    """The action at which another measure of risk is least, over the same draws."""
    actions = pour.tree["actions"]
    return Surface(*(actions[name].to_numpy() for name in Surface._fields)).least(risk)


def _figure(data: Dataset) -> Figure:
    labels = data["run"].to_numpy().tolist()
    expected = data.sel(rule="mean")
    bars = [("table's best", 100.0 * data["best"], None, GREY)]
    bars += [("liquid unknown", 100.0 * data["unknown"], data["unknown_error"], "#c9cfd6")]
    bars += [
        (f"chosen, {label}", 100.0 * one["spilled"], one["error"], colour)
        for label, colour in zip(labels, PALETTE, strict=False)
        for one in [expected.sel(run=label)]
    ]
    width = 0.8 / len(bars)
    with styled():
        figure = new_figure(7.4, 3.8)
        axes = figure.subplots()
        places = np.arange(data.sizes["liquid"])
        for at, (label, percent, error, colour) in enumerate(bars):
            x = places + width * (at - (len(bars) - 1) / 2)
            axes.bar(x, percent, 0.9 * width, color=colour, label=label)
            if error is not None:
                _whiskers(axes, x, percent, 100.0 * error)
            for rule, (marker, name) in OTHER_CHOICES.items() if at >= 2 else ():
                other = 100.0 * data["spilled"].sel(run=labels[at - 2], rule=rule)
                shown = name if at == 2 else None
                axes.plot(x, other, marker, color=INK, mfc="none", ms=5, label=shown)
        axes.set_xticks(places, data["liquid"].to_numpy())
        axes.set_ylabel("spilled in the reference solver [%]")
        figure.legend(loc="outside lower center", ncols=3)
    return figure


def _whiskers(axes: Axes, x: np.ndarray, percent: DataArray, error: DataArray) -> None:
    """Errors of the table; no less than nothing is spilled."""
    off = np.stack([np.minimum(error, percent), error])
    axes.errorbar(x, percent, off, fmt="none", ecolor=INK, elinewidth=0.8, alpha=0.6)


def _says(data: Dataset) -> str:
    lines = ["spilled by the reference solver [%], its table interpolated:"]
    for liquid in data["liquid"].to_numpy():
        for run in data["run"].to_numpy():
            one = data.sel(liquid=liquid, run=run)
            chosen = one.sel(rule="mean")
            plug_in, cautious = (
                100.0 * float(one["spilled"].sel(rule=rule)) for rule in OTHER_CHOICES
            )
            lines.append(
                f"  {liquid}, {run}: {100.0 * float(chosen['spilled']):.1f} "
                f"({_reliability(float(chosen['error']))}) at "
                f"{np.degrees(float(chosen['angular_velocity'])):.0f} deg/s, "
                f"{100.0 * float(chosen['distance']):.1f} cm; at theta* alone {plug_in:.1f}, by "
                f"CVaR {cautious:.1f}; table's best {100.0 * float(one['best']):.1f}; liquid "
                f"unknown {100.0 * float(one['unknown']):.1f}"
            )
    return "\n".join(lines)


def _reliability(error: float) -> str:
    if np.isnan(error):
        return "beyond the table: its edge"
    return f"error of interpolation {100.0 * error:.1f}"
