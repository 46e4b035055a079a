"""report.html: one file that shows a run, without anything from outside it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from . import narrative
from .calibration import Calibration
from .calibration_figures import discrepancy_figure, inclination_figure
from .criticism_chapter import criticism_context
from .files import write_text
from .posterior_figure import posterior_figure
from .run_directory import POUR, REPORT
from .summary import read_summary

TEMPLATE = "report.html.jinja"


def report(run: str | Path) -> Path:
    """Write RUN/report.html from what the run holds; nothing is simulated.

    Raises:
        InputError: The directory holds no finished calibration.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    calibration = Calibration.open(run)
    environment = Environment(
        loader=PackageLoader("bolfi_liquids", "data"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template(TEMPLATE).render(
        calibration=_calibration_context(calibration),
        criticism=criticism_context(calibration),
        pour=_pour_context(calibration.path),
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
        "floor_sentence": narrative.floor_sentence(section),
        "sampler_sentence": narrative.sampler_sentence(section),
        "inclination": inclination_figure(tree),
        "posterior": posterior_figure(tree),
        "discrepancy": discrepancy_figure(tree),
        "start": int(tree.attrs["initial"]),
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


def _pour_context(run: Path) -> dict[str, Any] | None:
    section = read_summary(run).get("pour")
    if section is None or not (run / POUR).is_file():
        return None
    from .pour_figure import pour_figure
    from .results import read_tree

    tree = read_tree(run / POUR, fix=f"write it again: bolfi-liquids pour {run}")
    return {
        "section": section,
        "sentence": narrative.pour_sentence(section),
        "figure": pour_figure(tree),
        "made_with": dict(tree.attrs),
        "rows": [("chosen pour", section), ("best at θ* alone", section["plug_in"])],
    }
