"""report.html: one file that shows a run, without anything from outside it."""

import json
from collections.abc import Callable, Mapping
from dataclasses import astuple
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from ..calibration.fit_figures import inclination_figure, stroke_figure
from ..calibration.posterior_figure import posterior_figure
from ..calibration.result import Calibration
from ..calibration.search_figure import search_figure
from ..calibration.summary import CalibrationSummary
from ..files import write_text
from ..hover_labels import script_json
from ..inputs.prior import Described
from ..pouring.result import Pour
from ..run.compute import open_compute
from ..run.run import REPORT, Run, RunOrPath
from ..wording import LIQUID_UNITS, sentence
from . import sentences
from .criticism_chapter import criticism_context
from .warnings import Results, warnings_of

if TYPE_CHECKING:
    from ..inference.simulations import Compute, Workers

PAGE_TEMPLATE = "report.html.jinja"


def report(
    run: RunOrPath,
    *,
    moving: bool = True,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> Path:
    """Write RUN/report.html from what the run holds.

    Args:
        run: A RUN directory with a finished calibration; or a calibration, criticism or pour.
        moving: Whether it has moving pictures, of a few stirs and pours that are simulated for
            them once and kept in RUN/frames.nc; nothing else is simulated.
        executor, timeout, progress: Of their simulations, see `calibrate`.

    Raises:
        InputError: The directory holds no finished calibration, or one of another model, or another
            command works in it.
        RuntimeError: A simulation took longer than `timeout`.
    """
    with (
        Run.entered(run) as opened,
        open_compute(executor, timeout) as compute,
    ):
        return written(Results.of(opened), compute, moving=moving, progress=progress)


def written(
    results: Results,
    compute: "Compute",
    *,
    moving: bool = True,
    progress: bool = True,
    chapters: Mapping[str, Any] = MappingProxyType({}),
) -> Path:
    """Write RUN/report.html from given results.

    Args:
        results: What the run holds.
        compute: Where moving pictures are simulated.
        moving, progress: See `report`.
        chapters: What is drawn already, by the names of `CHAPTERS`.
    """
    calibration = results.calibration
    pictures = _moving(results, compute, progress) if moving else None
    given = {name: getattr(results, name) for name in CHAPTERS}
    drawn = {
        name: chapters.get(name) or (one and CHAPTERS[name](one)) for name, one in given.items()
    }
    page = _page(drawn, results, pictures)
    return write_text(calibration.path / REPORT, page)


def _page(
    chapters: Mapping[str, Any],
    results: Results,
    pictures: dict[str, Any] | None,
) -> str:
    """The page of a run, with moving pictures if there are any."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("bolfi_liquids", "data"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(PAGE_TEMPLATE).render(
        **chapters,
        warnings=warnings_of(results),
        moving=pictures,
        moving_json=script_json(pictures),
        style=_text("report.css"),
        script=_text("report.js"),
        record=results.calibration.record,
        run=results.calibration.path,
    )


def calibration_context(calibration: Calibration) -> dict[str, Any]:
    summary, tree = calibration.summary, calibration.tree
    prior = tree["prior"]
    return {
        "summary": summary,
        "parameters": [
            sentences.parameter_sentence(name, values, prior[name].to_numpy().ravel())
            for name, values in summary.parameters.items()
        ],
        "fit": sentences.fit_sentence(summary),
        "model_error": sentences.model_error_sentence(summary),
        "inclination": inclination_figure(tree),
        "by_stroke": stroke_figure(tree),
        "posterior": posterior_figure(tree),
        "search": search_figure(tree),
        "start": min(int(tree.attrs["initial"]), summary.n_simulations),
        "confirming": tree["simulations"].sizes["simulation"] - summary.n_simulations,
        "priors": {
            name: prior_text(one) for name, one in calibration.record["settings"]["prior"].items()
        },
        "rows": [_row(name, summary) for name in summary.parameters],
    }


def prior_text(described: Described) -> str:
    """A distribution of run.toml as Python writes it, such as `LogUniform(0.003, 20)`."""
    values = {
        name: prior_text(value) if isinstance(value, Mapping) else f"{value:g}"
        for name, value in described.items()
        if name != "family"
    }
    if set(values) == {"low", "high"}:
        return f"{described['family']}({values['low']}, {values['high']})"
    named = ", ".join(f"{name}={value}" for name, value in values.items())
    return f"{described['family']}({named})"


def _row(name: str, summary: CalibrationSummary) -> dict[str, Any]:
    numbers = [*astuple(summary.parameters[name]), summary.best[name], summary.closest[name]]
    return {
        "name": name,
        "unit": LIQUID_UNITS.get(name, "1"),
        "numbers": [f"{number:.3g}" for number in numbers],
    }


def _pour_context(pour: Pour) -> dict[str, Any]:
    from .pour_figure import pour_figure

    summary, tree = pour.summary, pour.tree
    return {
        "summary": summary,
        "chosen": sentences.pour_sentence(summary),
        "plug_in": sentences.plug_in_sentence(summary),
        "fate": sentences.fate_sentences(summary),
        "given": sentences.given_sentences(summary),
        "map": sentences.map_sentences(summary),
        "limits": sentence("pour.limits"),
        "contact_angle": sentences.contact_angle_sentences(json.loads(tree.attrs["cups"])),
        "figure": pour_figure(tree),
        "made_with": {k: v for k, v in tree.attrs.items() if k not in ("made_from", "summary")},
        "rows": [("chosen pour", summary), ("best at θ* alone", summary.plug_in)],
    }


CHAPTERS: dict[str, Callable[[Any], dict[str, Any]]] = {
    "calibration": calibration_context,
    "criticism": criticism_context,
    "pour": _pour_context,
}
"""What the template needs of each result."""


def _moving(results: Results, compute: "Compute", progress: bool) -> dict[str, Any] | None:
    """Moving pictures of the latest posterior and the pour."""
    from .frames import Shown, frames_of
    from .moving_pictures import moving_context

    latest = results.latest
    shown = Shown(latest, latest.run.recordings[0], results.pour)
    return moving_context(shown, frames_of(shown, compute, progress=progress))


def _text(name: str) -> str:
    """Of a file that stands in the page as it is."""
    return (files("bolfi_liquids.data") / name).read_text(encoding="utf-8")
