"""report.html: one file that shows a run, without anything from outside it."""

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..calibration.result import Calibration
from ..criticism.result import latest_calibration
from ..files import write_text
from ..pouring.tree import read_pour
from ..run.directory import POUR, REPORT
from ..run.summary import read_summary
from . import sentences as narrative
from .calibration_figures import inclination_figure, stroke_figure
from .criticism_chapter import criticism_context
from .hover import script_json
from .posterior_figure import posterior_figure
from .search_figure import search_figure
from .warnings import worries

if TYPE_CHECKING:
    from xarray import DataTree

TEMPLATE = "report.html.jinja"


def report(run: str | Path, *, moving: bool = True, progress: bool = True) -> Path:
    """Write RUN/report.html from what the run holds.

    Args:
        run: A RUN directory with a finished calibration.
        moving: Whether it has moving pictures, of a few stirs and pours that are simulated for
            them once and kept in RUN/frames.nc; nothing else is simulated.
        progress: Whether to show a bar on stderr while they are.

    Raises:
        InputError: The directory holds no finished calibration.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    calibration = Calibration.open(run)
    sections = read_summary(calibration.path)
    pour, criticism = _pour_tree(calibration.path), criticism_context(calibration)
    pictures = _moving(calibration, progress) if moving else None
    environment = Environment(
        loader=PackageLoader("bolfi_liquids", "data"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template(TEMPLATE).render(
        calibration=_calibration_context(calibration),
        criticism=criticism,
        pour=None if pour is None else _pour_context(sections["pour"], pour),
        worries=worries(
            calibration.summary,
            criticism and criticism["section"],
            None if pour is None else sections["pour"],
            pour,
            latest_calibration(calibration.path).posterior,
            calibration.summary["n_simulations"] - int(calibration.tree.attrs["initial"]),
        ),
        moving=pictures,
        moving_json=script_json(pictures),
        style=_text("report.css"),
        script=_text("report.js"),
        record=calibration.record,
        run=calibration.path,
    )
    return write_text(calibration.path / REPORT, page)


def _calibration_context(calibration: Calibration) -> dict[str, Any]:
    section, tree = calibration.summary, calibration.tree
    prior = tree["prior"]
    sentences = [
        narrative.parameter_sentence(name, values, prior[name].to_numpy().ravel())
        for name, values in section["parameters"].items()
    ]
    return {
        "section": section,
        "sentences": sentences,
        "fit_sentence": narrative.fit_sentence(section),
        "inclination": inclination_figure(tree),
        "by_stroke": stroke_figure(tree),
        "posterior": posterior_figure(tree),
        "search": search_figure(tree),
        "start": min(int(tree.attrs["initial"]), section["n_simulations"]),
        "rows": [_row(name, section) for name in section["parameters"]],
    }


def _row(name: str, section: Mapping[str, Any]) -> dict[str, Any]:
    values = section["parameters"][name]
    numbers = [values[key] for key in ("mean", "sd", "q05", "q50", "q95")]
    numbers += [section["best"][name], section["closest"][name]]
    return {
        "name": name,
        "unit": narrative.UNITS.get(name, "1"),
        "numbers": [f"{number:.3g}" for number in numbers],
    }


def _pour_tree(run: Path) -> "DataTree | None":
    """pour.nc, where a pour was chosen."""
    if "pour" not in read_summary(run) or not (run / POUR).is_file():
        return None
    return read_pour(run)


def _pour_context(section: Mapping[str, Any], tree: "DataTree") -> dict[str, Any]:
    from .pour_figure import pour_figure

    return {
        "section": section,
        "sentence": narrative.pour_sentence(section),
        "sure_sentence": narrative.sure_sentence(section),
        "limits": narrative.LIMITS,
        "figure": pour_figure(tree),
        "made_with": dict(tree.attrs),
        "rows": [("chosen pour", section), ("best at θ* alone", section["plug_in"])],
    }


def _moving(calibration: Calibration, progress: bool) -> dict[str, Any] | None:
    from ..run.recordings import FOLDER
    from .frames import frames_of
    from .moving_pictures import moving_context

    if not (calibration.path / FOLDER).is_dir():  # of a run that was made before they were kept
        return None
    return moving_context(calibration, frames_of(calibration.path, progress=progress))


def _text(name: str) -> str:
    """Of a file that stands in the page as it is."""
    return (files("bolfi_liquids.data") / name).read_text(encoding="utf-8")
