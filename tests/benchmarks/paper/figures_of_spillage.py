"""The paper's figure 2, right: spillage against the number of simulations, and by liquid; and what
it left open: whether deciding over the posterior is better, and which surrogate."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from xarray import DataArray, Dataset

from bolfi_liquids.drawing import GREY, PALETTE, new_figure, plain_log_ticks, styled
from bolfi_liquids.seeds import generator

from .figure import Drawn
from .phases import Phase
from .shared_simulations import SharedSimulations
from .truths import LIQUIDS

SHOWN_LEARNERS = {
    ("discrepancy", "plug_in"): "stirring, the paper's: Φ, best at θ*",
    ("discrepancy", "mean"): "stirring, Φ, least expected",
    ("signal", "plug_in"): "stirring, signal, best at θ*",
    ("signal", "mean"): "stirring, signal, least expected",
    ("signal", "cvar"): "stirring, signal, CVaR",
    ("pour", "plug_in"): "pouring, best at θ*",
    ("pour", "mean"): "pouring, least expected",
}
"""(method, rule) -> label."""
COLOURS = dict(zip(SHOWN_LEARNERS, (*PALETTE, "#c2185b"), strict=True))  # the same in every figure
FEW_PERCENT = (0, 0.5, 1, 2, 5, 10, 20, 50)  # ticks of an axis that is linear up to 1 %
BOOTSTRAP_SAMPLES = 4000  # bootstrap samples
BAND_LEVEL = 0.9


def interval(values: NDArray, seed: int = 0) -> tuple[float, float]:
    """90 % bootstrap interval of the mean of values, shape (n,); NaN of none.

    Truths are resampled whatever their liquid, which makes it rather wide: of each liquid there
    are as many.
    """
    if not len(values):
        return np.nan, np.nan
    rng = generator(seed, Phase.BOOTSTRAP)
    means = values[rng.integers(0, len(values), (BOOTSTRAP_SAMPLES, len(values)))].mean(axis=1)
    low, high = np.quantile(means, [(1 - BAND_LEVEL) / 2, (1 + BAND_LEVEL) / 2])
    return float(low), float(high)


def spillage(shared: SharedSimulations) -> Drawn:
    """Spilled percentage against N for calibration by stirring and by pouring."""
    study = complete(shared.study)
    budgets = study["budget"].to_numpy()
    with styled():
        figure = new_figure(7.4, 4.6)
        axes = figure.subplots()
        for at, (method, rule) in enumerate(SHOWN_LEARNERS):
            chosen = study["spilled"].sel(learned_by=method, rule=rule)
            _against_budget(axes, chosen, (method, rule), at)
        for name, style in (("known", ":"), ("unknown", "--")):
            level = 100.0 * float(study[name].mean())
            axes.axhline(level, color=GREY, ls=style, lw=1.0, label=f"liquid {name}")
        axes.set(xlabel="simulations N", ylabel="spilled [%]")
        plain_log_ticks(axes, "y")
        axes.set_xticks(range(len(budgets)), [str(n) for n in budgets])
        figure.legend(loc="outside lower center", ncols=2)
    return Drawn(study, figure, _table(study))


def _against_budget(axes: Axes, spilled: DataArray, way: tuple[str, str], at: int) -> None:
    """Means, with 90 % intervals, side by side for those that are compared."""
    percent = 100.0 * spilled.transpose("budget", "truth").to_numpy()
    means, ends = percent.mean(axis=1), np.array([interval(row) for row in percent])
    x = np.arange(len(means)) + 0.06 * (at - (len(SHOWN_LEARNERS) - 1) / 2)
    colour = COLOURS[way]
    axes.plot(x, means, "-", color=colour, lw=0.8, alpha=0.5)
    off = np.abs(ends.T - means)
    axes.errorbar(
        x, means, off, fmt="o", color=colour, ms=4, elinewidth=1.2, label=SHOWN_LEARNERS[way]
    )


def _table(study: Dataset) -> str:
    lines = ["spilled [%], mean over liquids and repetitions:"]
    for (method, rule), label in SHOWN_LEARNERS.items():
        means = 100.0 * study["spilled"].sel(learned_by=method, rule=rule).mean("truth")
        pairs = (
            f"N = {int(n)}: {float(m):.2f}" for n, m in zip(means["budget"], means, strict=True)
        )
        lines.append(f"  {label}: " + ", ".join(pairs))
    known, unknown = (100.0 * float(study[name].mean()) for name in ("known", "unknown"))
    lines.append(f"  liquid known: {known:.2f}, unknown: {unknown:.2f}")
    if left_out := study.attrs["left_out"]:
        total = left_out + study.sizes["truth"]
        lines.append(f"  without {left_out} of {total} truths, where a calibration or pour failed")
    return "\n".join(lines)


def complete(study: Dataset) -> Dataset:
    """The truths of which every calibration and every pour succeeded, so that means compare equals.

    How many are not is its attribute `left_out`.
    """
    spilled = study[["spilled", "known", "unknown"]].to_array().notnull()
    whole = spilled.all([name for name in spilled.dims if name != "truth"]).to_numpy()
    return study.isel(truth=whole).assign_attrs(left_out=int((~whole).sum()))


def liquids(shared: SharedSimulations) -> Drawn:
    """Spilled percentage by liquid at N = 10 and 20, or else at the largest N."""
    study = complete(shared.study)
    made = study["budget"].to_numpy().tolist()
    budgets = [n for n in (10, 20) if n in made] or made[-1:]
    rules = [
        ("discrepancy", "plug_in"),
        ("signal", "plug_in"),
        ("signal", "mean"),
        ("signal", "cvar"),
        ("pour", "plug_in"),
        ("pour", "mean"),
    ]
    with styled():
        figure = new_figure(8.6, 3.6)
        panels = figure.subplots(1, len(budgets), sharey=True, squeeze=False)[0]
        for axes, budget in zip(panels, budgets, strict=True):
            for at, (method, rule) in enumerate(rules):
                chosen = study["spilled"].sel(learned_by=method, rule=rule, budget=budget)
                for place, liquid in enumerate(LIQUIDS):
                    percent = 100.0 * chosen.to_numpy()[study["liquid"].to_numpy() == liquid]
                    if not len(percent):
                        continue
                    x = place + 0.8 / len(rules) * (at - (len(rules) - 1) / 2)
                    label = SHOWN_LEARNERS[method, rule] if place == 0 else None
                    colour, width = COLOURS[method, rule], 0.7 / len(rules)
                    axes.bar(x, percent.mean(), width, color=colour, alpha=0.6, label=label)
                    axes.plot(np.full(len(percent), x), percent, ".", color=colour, ms=4)
            axes.set_xticks(range(len(LIQUIDS)), list(LIQUIDS))
            axes.set_title(f"N = {budget}")
        panels[0].set_ylabel("spilled [%]")
        panels[0].set_yscale("symlog", linthresh=1.0)
        panels[0].set_yticks(FEW_PERCENT, map(str, FEW_PERCENT))
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    last = study["spilled"].sel(learned_by="signal", rule="mean", budget=budgets[-1])
    by_liquid = (100.0 * last).groupby(study["liquid"]).mean()
    told = [name for name in LIQUIDS if name in by_liquid["liquid"]]
    says = ", ".join(f"{name} {float(by_liquid.sel(liquid=name)):.2f} %" for name in told)
    return Drawn(study, figure, f"least expected after N = {budgets[-1]} stirs: {says}")


def decision(shared: SharedSimulations) -> Drawn:
    """What deciding over the posterior saves against the plug-in at theta*, paired by truth."""
    study = complete(shared.study)
    spilled = 100.0 * study["spilled"]
    apart = spilled.sel(rule=["mean", "cvar"]) - spilled.sel(rule="plug_in", drop=True)
    dims = ("learned_by", "rule", "budget")
    ends = np.apply_along_axis(interval, -1, apart.transpose(*dims, "truth").to_numpy())
    data = Dataset(
        {
            "difference": apart,
            "mean": apart.mean("truth"),
            "low": (dims, ends[..., 0]),
            "high": (dims, ends[..., 1]),
        }
    )
    budgets = study["budget"].to_numpy()
    lines = ["spilled by the rule minus by the plug-in [percentage points], paired, with 90 %:"]
    with styled():
        figure = new_figure(7.4, 3.8)
        axes = figure.subplots()
        pairs = [(m, r) for m in ("discrepancy", "signal", "pour") for r in ("mean", "cvar")]
        for at, (method, rule) in enumerate(pairs):
            one = data.sel(learned_by=method, rule=rule)
            means, low, high = (one[name].to_numpy() for name in ("mean", "low", "high"))
            x = np.arange(len(budgets)) + 0.12 * (at - (len(pairs) - 1) / 2)
            off = np.stack([means - low, high - means])
            label = f"{method}, {'least expected' if rule == 'mean' else 'CVaR'}"
            axes.errorbar(x, means, off, fmt="o", ms=4, color=PALETTE[at], label=label)
            told = (
                f"N = {n}: {m:+.2f} [{a:+.2f}, {b:+.2f}]"
                for n, m, a, b in zip(budgets, means, low, high, strict=True)
            )
            lines.append(f"  {label}: " + ", ".join(told))
        axes.axhline(0.0, color=GREY, lw=0.8)
        axes.set_xticks(range(len(budgets)), [f"N = {n}" for n in budgets])
        axes.set_ylabel("spilled more than the plug-in [% points]")
        axes.set_yscale("symlog", linthresh=1.0)
        ticks = [*(-tick for tick in FEW_PERCENT[:0:-1]), *FEW_PERCENT]
        axes.set_yticks(ticks, [f"{tick:+g}" if tick else "0" for tick in ticks])
        figure.legend(loc="outside lower center", ncols=3)
    return Drawn(data, figure, "\n".join(lines))


def surrogates(shared: SharedSimulations) -> Drawn:
    """Error of the viscosity at equal N: the signal surrogate against the paper's."""
    study = complete(shared.study)
    drawn = study["concluded"].sel(parameter="viscosity").isel(draw=slice(1, None))
    dims = ("learned_by", "truth", "budget")
    factors = drawn.transpose(*dims, "draw") / study["viscosity"]
    by_truth = np.abs(np.log(factors.to_numpy())).mean(axis=-1)
    error = DataArray(by_truth, {name: study[name] for name in ("learned_by", "budget")}, dims)
    budgets = study["budget"].to_numpy()
    lines = ["mean distance of draws from the truth, factor in viscosity:"]
    with styled():
        figure = new_figure(6.4, 3.6)
        axes = figure.subplots()
        for method, colour in zip(study["learned_by"].to_numpy(), PALETTE, strict=False):
            rows = error.sel(learned_by=method).transpose("budget", "truth").to_numpy()
            means = rows.mean(axis=1)
            ends = np.array([interval(row) for row in rows])
            axes.fill_between(budgets, *np.exp(ends.T), color=colour, alpha=0.15, lw=0)
            label = {"pour": "pouring", "signal": "stirring, signal"}.get(method, "stirring, Φ")
            axes.plot(budgets, np.exp(means), "o-", ms=4, color=colour, label=label)
            told = (f"N = {n}: {np.exp(m):.2f}" for n, m in zip(budgets, means, strict=True))
            lines.append(f"  {label}: " + ", ".join(told))
        axes.set(xlabel="simulations N", ylabel="factor between draws and truth")
        plain_log_ticks(axes, "y")
        axes.set_xticks(budgets, [str(n) for n in budgets])
        axes.legend()
    return Drawn(Dataset({"log_error": error}), figure, "\n".join(lines))
