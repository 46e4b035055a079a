"""report.html: one file that shows a run, without anything from outside it."""

import json
from collections.abc import Mapping
from dataclasses import astuple
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..calibration.fit_figures import inclination_figure, stroke_figure
from ..calibration.former_model import refuse_other_model
from ..calibration.posterior_figure import posterior_figure
from ..calibration.result import Calibration
from ..calibration.search_figure import search_figure
from ..calibration.summary import CalibrationSummary
from ..files import write_text
from ..hover_labels import script_json
from ..inputs.prior import Described
from ..pouring.result import PourSummary
from ..run.directory import REPORT, Run, run_path
from ..run.entering import working_in_run
from ..wording import LIQUID_UNITS, sentence
from . import sentences
from .criticism_chapter import criticism_context
from .warnings import Results, results_of, warnings_of

if TYPE_CHECKING:
    from xarray import DataTree

    from ..inference.simulations import Workers

PAGE_TEMPLATE = "report.html.jinja"


def report(
    run: Run,
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
        executor: Where they are simulated, see `calibrate`; the result has the same bits.
        timeout: Seconds that one simulation may take; None sets no limit.
        progress: Whether to show a bar on stderr while they are.

    Raises:
        InputError: The directory holds no finished calibration, or one of another model, or another
            command works in it.
        RuntimeError: A simulation took longer than `timeout`.
    """
    how = {"executor": executor, "timeout": timeout, "progress": progress}
    with working_in_run(run_path(run)):
        calibration = Calibration.open(run_path(run))
        refuse_other_model(calibration)
        # before anything is simulated: a damaged file is refused
        results, criticism = results_of(calibration), criticism_context(calibration)
        pictures = _moving(calibration, how) if moving else None
        page = _page(calibration, results, criticism, pictures)
        return write_text(calibration.path / REPORT, page)


def _page(
    calibration: Calibration,
    results: Results,
    criticism: dict[str, Any] | None,
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
        calibration=_calibration_context(calibration),
        criticism=criticism,
        pour=_pour_context(results.poured, results.pour),
        warnings=warnings_of(results),
        moving=pictures,
        moving_json=script_json(pictures),
        style=_text("report.css"),
        script=_text("report.js"),
        record=calibration.record,
        run=calibration.path,
    )


def _calibration_context(calibration: Calibration) -> dict[str, Any]:
    summary, tree = calibration.summary, calibration.tree
    prior = tree["prior"]
    return {
        "summary": summary,
        "parameters": [
            sentences.parameter_sentence(name, values, prior[name].to_numpy().ravel())
            for name, values in summary.parameters.items()
        ],
        "fit": sentences.fit_sentence(summary),
        "inclination": inclination_figure(tree),
        "by_stroke": stroke_figure(tree),
        "posterior": posterior_figure(tree),
        "search": search_figure(tree),
        "start": min(int(tree.attrs["initial"]), summary.n_simulations),
        "priors": {
            name: prior_text(one) for name, one in calibration.record["settings"]["prior"].items()
        },
        "rows": [_row(name, summary) for name in summary.parameters],
    }


def prior_text(described: Described | str) -> str:
    """A distribution of run.toml as Python writes it, such as `LogUniform(0.003, 20)`.

    A text, as version 0.1 wrote it, stays.
    """
    if isinstance(described, str):
        return described
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


def _pour_context(summary: PourSummary | None, tree: "DataTree | None") -> dict[str, Any] | None:
    if summary is None or tree is None:
        return None
    from .pour_figure import pour_figure

    return {
        "summary": summary,
        "chosen": sentences.pour_sentence(summary),
        "plug_in": sentences.plug_in_sentence(summary),
        "map": sentences.map_sentences(summary),
        "limits": sentence("pour.limits"),
        "contact_angle": sentences.contact_angle_sentences(json.loads(tree.attrs["cups"])),
        "figure": pour_figure(tree),
        "made_with": dict(tree.attrs),
        "rows": [("chosen pour", summary), ("best at θ* alone", summary.plug_in)],
    }


def _moving(calibration: Calibration, how: Mapping[str, Any]) -> dict[str, Any] | None:
    """Moving pictures, simulated by the arguments `how` of `frames_of`."""
    from ..run.recordings import RECORDINGS_FOLDER
    from .frames import frames_of
    from .moving_pictures import moving_context

    if not (
        calibration.path / RECORDINGS_FOLDER
    ).is_dir():  # of a run that was made before they were kept
        return None
    return moving_context(calibration, frames_of(calibration.path, **how))


def _text(name: str) -> str:
    """Of a file that stands in the page as it is."""
    return (files("bolfi_liquids.data") / name).read_text(encoding="utf-8")
