"""One HTML page that shows a fit, with nothing from outside it; imports Matplotlib and Jinja."""

import warnings
from base64 import b64encode
from collections.abc import Callable, Iterator
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jinja2 import Environment, StrictUndefined
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .figures import COLOURS, GREY, INK, bare

TEMPLATE = "fit_report.html.jinja"
SHARES = 0.05, 0.5, 0.95
SIZE = 4.2, 2.6  # inch
LINE = 5  # values from which an output is drawn as a line
MOST_CHANNELS = 6  # that are drawn
NEXT = {
    "fitted": "The posterior can be used. Of a fit that has its simulator, fit.check() measures on "
    "data of known truth whether its intervals cover what they should.",
    "not confirmed": "Simulate more. A call of fit with a larger budget and the same bank goes on "
    "where it ended; trials of an optimiser are given as earlier= beside their simulator. Until "
    "then the posterior may be off.",
    "not fitted": "Do not use the posterior: no parameters explain what was observed. "
    "fit.criticise(extensions) looks for what the simulator lacks; look at the data, too, and at "
    "noise=, which may be too small.",
}
"""What to do where a fit has this status."""
LOOK = {"svg.hashsalt": "fit", "svg.fonttype": "none", "font.family": "sans-serif"}


class Picture(NamedTuple):
    """A figure as an address that holds its data, what is drawn, and what it shows."""

    source: str
    alt: str
    caption: str


class Row(NamedTuple):
    """A parameter."""

    name: str
    unit: str
    prior: str
    low: str
    middle: str
    high: str
    narrower: str  # sd of the prior over that of the posterior
    rhat: str


def write_report(path: str | Path, fit: Any, tree: Any) -> Path:
    """See `Fit.report`; `fit` is one, `tree` what it sampled."""
    checks = tree["emulator_checks"]
    z = checks["loo_z"].to_numpy() if "loo_z" in checks else np.zeros(0)
    checked = np.isfinite(z).any()
    with rc_context(LOOK):
        page = _template().render(
            fit=fit,
            rows=list(_rows(fit, tree)),
            marginals=[_marginal(fit, tree, name) for name in fit.prior.names],
            outputs=list(_outputs(tree)),
            loo=_errors(z) if checked else None,
            loo_size=float(np.sqrt(np.nanmean(np.square(z)))) if checked else None,
            posterior=tree["posterior"].attrs,
            advice=NEXT[fit.status],
            made=tree.attrs,
        )
    path = Path(path)
    path.write_text(page, encoding="utf-8")
    return path


def _template() -> Any:
    rules = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return rules.from_string((files(__package__) / TEMPLATE).read_text(encoding="utf-8"))


def _rows(fit: Any, tree: Any) -> Iterator[Row]:
    for name, described in fit.prior.describe().items():
        draws, before = (tree[group][name].to_numpy() for group in ("posterior", "prior"))
        low, middle, high = (f"{value:.4g}" for value in np.quantile(draws, SHARES))
        narrower = f"{before.std() / max(draws.std(), np.finfo(float).tiny):.3g}"
        rhat = f"{tree['posterior'][name].attrs['rhat']:.3f}"
        unit = described.get("units", "")
        yield Row(name, unit, described["prior"], low, middle, high, narrower, rhat)


def _picture(draw: Callable[[Axes], None], alt: str, caption: str) -> Picture:
    figure, held = Figure(SIZE, layout="constrained"), BytesIO()
    draw(bare(figure.subplots()))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # letters are the browser's, of any script
        figure.savefig(held, format="svg", metadata={"Date": None}, transparent=True)
    source = f"data:image/svg+xml;base64,{b64encode(held.getvalue()).decode()}"
    return Picture(source, alt, caption)


def _marginal(fit: Any, tree: Any, name: str) -> Picture:
    draws = tree["posterior"][name].to_numpy().ravel()
    low, middle, high = np.quantile(draws, SHARES)
    ends = fit.prior.from_unit(np.tile([[0.0], [1.0]], len(fit.prior)))[name]
    reach = 1.5 * (high - low)
    first, last = np.clip([middle - reach, middle + reach], *ends)
    x = np.linspace(first, last, 200)
    density = None  # a model of dependent parameters has none of one alone
    if fit.prior.model is None:
        median = fit.prior.from_unit(np.full(len(fit.prior), 0.5))
        at = {other: np.full(x.size, value) for other, value in median.items()} | {name: x}
        density = np.exp(fit.prior.log_probs(at)[name])

    def draw(ax: Axes) -> None:
        ax.hist(draws, 40, range=(x[0], x[-1]), density=True, color=COLOURS[0], alpha=0.6)
        if density is not None:
            ax.plot(x, density, color=GREY, label="prior")
            ax.legend(frameon=False, fontsize="small", labelcolor=INK)
        label = f"{name} [{fit.prior.units[name]}]" if name in fit.prior.units else name
        ax.set_xlabel(label, parse_math=False)
        ax.set_yticks([])

    line = "" if density is None else ", and a line for its prior"
    said = f"Half of the draws of {name} lie below {middle:.4g}, 90 % from {low:.4g} to {high:.4g}."
    return _picture(draw, f"Histogram of the posterior of {name}{line}", said)


def _outputs(tree: Any) -> Iterator[Picture]:
    """What was observed and what is predicted, a picture for each channel."""
    predicted = tree["posterior_predictive"] if "posterior_predictive" in tree.children else {}
    for name in [name for name in tree["observed_data"].data_vars if name in predicted][:1]:
        values = predicted[name].to_numpy()
        seen = tree["observed_data"][name].to_numpy()
        seen = seen.reshape(len(seen), -1)
        values = values.reshape(-1, *seen.shape)
        for channel in np.flatnonzero(np.isfinite(seen).any(0))[:MOST_CHANNELS]:
            yield _output(name, channel, seen[:, channel], values[:, :, channel])


def _output(name: str, channel: int, seen: np.ndarray, values: np.ndarray) -> Picture:
    low, middle, high = np.quantile(values, SHARES, axis=0)
    there = np.isfinite(seen)
    inside = np.mean(((seen >= low) & (seen <= high))[there])
    at = np.arange(len(seen))

    def draw(ax: Axes) -> None:
        if len(seen) < LINE:
            reach = np.stack([middle - low, high - middle])
            ax.errorbar(at, middle, reach, fmt="_", color=COLOURS[0], label="predicted, 90 %")
        else:
            ax.fill_between(at, low, high, color=COLOURS[0], alpha=0.4, label="predicted, 90 %")
        ax.plot(at, seen, ".", ms=4, color=COLOURS[1], label="observed")
        ax.set(xlabel="number of the value", ylabel=name)
        ax.legend(frameon=False, fontsize="small", labelcolor=INK)

    said = f"{inside:.0%} of what was observed lies in the bands that are to hold 90 % of it."
    return _picture(draw, f"Observed {name}, channel {channel}, and bands of predictions", said)


def _errors(z: np.ndarray) -> Picture:
    z = z.reshape(len(z), -1)

    def draw(ax: Axes) -> None:
        ax.axhspan(-2.0, 2.0, color=GREY, alpha=0.25, lw=0)
        for j, column in enumerate(z.T):
            ax.plot(column, ".", color=COLOURS[j % len(COLOURS)])
        ax.set(xlabel="simulation", ylabel="error left out [sd]")

    beyond = np.mean(np.abs(z[np.isfinite(z)]) > 2.0)
    said = f"{beyond:.0%} of the errors exceed 2 standard deviations; 5 % are to be expected."
    return _picture(draw, "Studentised errors of the emulator at simulations left out", said)
