"""report.html: one file that shows a run, without anything from outside it."""

import base64
import json
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from ..calibration.fit_figures import draw_fit, draw_strokes
from ..calibration.posterior_figure import draw_posterior
from ..calibration.search_figure import draw_search
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
from ..inputs.settings import PourSettings
from ..pouring.figures import pour_figure
from ..run.compute import open_compute
from ..run.run import REPORT, RUN_TOML, Run, RunOrPath
from .facts import held_out_of
from .prose import prose
from .warnings import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..inference.simulations import Compute, Workers

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
    with (
        Run.entered(run) as opened,
        open_compute(executor, timeout) as compute,
    ):
        return written(Results.of(opened), compute, moving=moving, progress=progress)


def written(
    results: Results, compute: "Compute", *, moving: bool = True, progress: bool = True
) -> Path:
    """Write RUN/report.html from given results.

    Args:
        results: What the run holds.
        compute: Where moving pictures are simulated.
        moving, progress: See `report`.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("bolfi_liquids", "data"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    facts = results.facts
    films = partial(_films, results, compute, progress) if moving else dict
    with ThreadPoolExecutor(1) as thread:
        # workers make films while figures are drawn; without any, Taichi stays in this thread
        made = None if compute.executor is None else thread.submit(films)
        figures = figures_of(results)
        shown = films() if made is None else made.result()
    page = environment.get_template(PAGE_TEMPLATE).render(
        **facts,
        prose=partial(prose, facts=facts),
        figures=figures,
        films=shown,
        made_from=_made_from(results),
        style=(files("bolfi_liquids.data") / STYLE).read_text(encoding="utf-8"),
        record=results.calibration.record,
        run=results.calibration.path,
    )
    return write_text(results.calibration.path / REPORT, page)


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
    if held_out_of(stirs) is not None:
        drawn["held-out"] = held_out_plot(stirs)
    if "pours" in sources:
        drawn["pours"] = pour_residual_plot(sources["pours"])
    for name, source in sources.items():
        drawn[f"scores-{name}"] = score_plot(source)
        drawn[f"confusion-{name}"] = confusion_plot(source)
    return {name: plot.figure for name, plot in drawn.items()}


def _films(results: Results, compute: "Compute", progress: bool) -> dict[str, list[dict[str, str]]]:
    """The films of the latest posterior and the pour: caption, a still and the film, as URLs."""
    from .films import films_of

    shown: dict[str, list[dict[str, str]]] = {}
    for film in films_of(results.latest, results.pour, compute, progress=progress):
        if content := film.path.read_bytes():
            each = {"liquid": str(film.draw), "still": _url(_still(content)), "film": _url(content)}
            shown.setdefault(film.scene.name, []).append(each)
    return shown


def _still(content: bytes) -> bytes:
    """The picture in the middle of a film."""
    from PIL import Image, ImageSequence

    picture = BytesIO()
    with Image.open(BytesIO(content)) as film:
        pictures = ImageSequence.all_frames(film)
    pictures[len(pictures) // 2].convert("RGB").save(picture, "WEBP", quality=85)
    return picture.getvalue()


def _url(content: bytes) -> str:
    return f"data:image/webp;base64,{base64.b64encode(content).decode()}"


def _made_from(results: Results) -> dict[str, str]:
    """The texts of run.toml, and of what criticism and pour were made from."""
    run = results.calibration.run
    made = {RUN_TOML: (run.path / RUN_TOML).read_text(encoding="utf-8")}
    if results.criticism is not None:
        made["criticism"] = json.dumps(results.criticism.made_from, indent=1)
    if results.pour is not None:
        attrs = results.pour.tree.attrs
        settings = {name: attrs[name] for name in PourSettings.__dataclass_fields__}
        cups = {"cups": json.loads(attrs["cups"])}
        made["pour"] = json.dumps(settings | cups, indent=1, default=lambda number: number.item())
    return made
