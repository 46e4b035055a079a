"""report.html: one file that shows a run, without anything from outside it."""

import json
import logging
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from ..calibration.figures import draw_fit, draw_posterior, draw_search, draw_strokes
from ..criticism.figures import (
    coefficient_plot,
    confusion_plot,
    held_out_plot,
    pour_residual_plot,
    residual_plot,
    score_plot,
    stroke_plot,
)
from ..criticism.result import Criticism
from ..drawing import styled, to_svg
from ..files import write_text
from ..pouring.figures import pour_figure
from ..run.compute import open_compute
from ..run.run import REPORT, RUN_TOML, Run, RunOrPath
from .films import Film, films_of
from .prose import prose, templates
from .warnings import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..inference.simulations import Workers

logger = logging.getLogger(__name__)

PAGE_TEMPLATE, STYLE = "report.html.jinja", "report.css"


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
            them once and kept in RUN/moving; nothing else is simulated.
        executor, timeout, progress: Of their simulations, see `calibrate`.

    Raises:
        InputError: The directory holds no finished calibration, or one of another model, or another
            command works in it.
        RuntimeError: A simulation took longer than `timeout`.
    """
    with Run.entered(run) as opened, open_compute(executor, timeout) as compute:
        results = Results.of(opened)
        opened.tell_missing_bank()
        facts = results.facts
        for notice in results.outdated:
            logger.warning(notice)
        films: list[Film] = []
        if moving:
            films = films_of(results.latest, results.pour, compute, progress=progress)
        page = (
            templates(autoescape=True)
            .get_template(PAGE_TEMPLATE)
            .render(
                **facts,
                prose=partial(prose, facts=facts),
                figures=figures_of(results),
                films=[film for film in films if film.path.stat().st_size],  # else it diverged
                made_from=_made_from(results),
                style=(files("bolfi_liquids.data") / STYLE).read_text(encoding="utf-8"),
                record=opened.record,
                run=opened.path,
            )
        )
        return write_text(opened.path / REPORT, page)


def figures_of(results: Results) -> dict[str, str]:
    """The figures of a page, SVG elements by name."""
    tree = results.calibration.tree
    with styled():
        drawn = {
            "inclination": draw_fit(tree).figure,
            "by-stroke": draw_strokes(tree).figure,
            "posterior": draw_posterior(tree).figure,
            "search": draw_search(tree).figure,
        }
        if results.criticism is not None:
            drawn |= _criticism_figures(results.criticism)
        if results.pour is not None:
            drawn["pour"] = pour_figure(results.pour.tree)
        return {name: to_svg(figure, name) for name, figure in drawn.items()}


def _criticism_figures(criticism: Criticism) -> dict[str, "Figure"]:
    tree, accepted = criticism.tree, criticism.summary.accepted
    sources = {name: tree.children[name] for name in ("stirs", "pours") if name in tree.children}
    stirs = sources["stirs"]
    drawn = {"residual": residual_plot(stirs), "strokes": stroke_plot(stirs)}
    if accepted:
        drawn["coefficient"] = coefficient_plot(tree, accepted)
    if "held_out" in stirs.children:
        drawn["held-out"] = held_out_plot(stirs)
    if "pours" in sources:
        drawn["pours"] = pour_residual_plot(sources["pours"])
    for name, source in sources.items():
        if source["effects"].sizes["effect"]:  # else none acts there
            drawn[f"scores-{name}"] = score_plot(source)
            drawn[f"confusion-{name}"] = confusion_plot(source)
    return {name: plot.figure for name, plot in drawn.items()}


def _made_from(results: Results) -> dict[str, str]:
    """The texts of run.toml, and of what criticism and pour were made from."""
    run = results.calibration.run
    made = {RUN_TOML: (run.path / RUN_TOML).read_text(encoding="utf-8")}
    for name, result in (("criticism", results.criticism), ("pour", results.pour)):
        if result is not None:
            made[name] = json.dumps(json.loads(result.tree.attrs["made_from"]), indent=1)
    return made
