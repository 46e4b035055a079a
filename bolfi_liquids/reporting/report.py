"""report.html: one file that shows a run, without anything from outside it."""

import base64
from collections.abc import Callable, Mapping
from functools import partial
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from ..calibration.fit_figures import inclination_figure, stroke_figure
from ..calibration.posterior_figure import posterior_figure
from ..calibration.result import Calibration
from ..calibration.search_figure import search_figure
from ..criticism.effect_figures import coefficient_plot, confusion_plot, score_plot
from ..criticism.figures import held_out_plot, pour_residual_plot, residual_plot, stroke_plot
from ..criticism.result import Criticism
from ..drawing import to_svg
from ..files import write_text
from ..inputs.prior import Described
from ..pouring.figures import pour_figure
from ..pouring.result import Pour
from ..run.compute import Compute, open_compute
from ..run.run import REPORT, Run, RunOrPath
from ..wording import spoken
from .facts import held_out_of
from .prose import prose
from .warnings import Results

if TYPE_CHECKING:
    from ..inference.simulations import Workers

PAGE_TEMPLATE, STYLE = "report.html.jinja", "report.css"

Figures = dict[str, str]
"""SVG elements by name."""


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
        open_compute(executor, timeout, progress=progress) as compute,
    ):
        return written(Results.of(opened), compute, moving=moving)


def written(
    results: Results,
    compute: Compute,
    *,
    moving: bool = True,
    figures: Mapping[str, Figures] = MappingProxyType({}),
) -> Path:
    """Write RUN/report.html from given results.

    Args:
        results: What the run holds.
        compute: Where moving pictures are simulated.
        moving: See `report`.
        figures: Those that are drawn already, by the names of `FIGURES`.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("bolfi_liquids", "data"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    facts, given = results.facts, {name: getattr(results, name) for name in FIGURES}
    page = environment.get_template(PAGE_TEMPLATE).render(
        **facts,
        prose=partial(prose, facts=facts),
        figures={
            name: figures.get(name) or (one and FIGURES[name](one)) for name, one in given.items()
        },
        films=_films(results, compute) if moving else {},
        made_with=_made_with(results),
        style=(files("bolfi_liquids.data") / STYLE).read_text(encoding="utf-8"),
        record=results.calibration.record,
        run=results.calibration.path,
    )
    return write_text(results.calibration.path / REPORT, page)


def _calibration_figures(calibration: Calibration) -> Figures:
    tree = calibration.tree
    return {
        "inclination": inclination_figure(tree),
        "by_stroke": stroke_figure(tree),
        "posterior": posterior_figure(tree),
        "search": search_figure(tree),
    }


def _criticism_figures(criticism: Criticism) -> Figures:
    tree, accepted = criticism.tree, criticism.summary.accepted
    stirs, pours = tree.children["stirs"], tree.children.get("pours")
    drawn = {"residual": residual_plot(stirs), "strokes": stroke_plot(stirs)}
    if accepted:
        drawn["coefficient"] = coefficient_plot(tree, accepted)
    if held_out_of(stirs) is not None:
        drawn["held_out"] = held_out_plot(stirs)
    if pours is not None:
        drawn["pours"] = pour_residual_plot(pours)
    for name, source in tree.children.items():
        if name in ("stirs", "pours"):
            drawn[f"scores_{name}"] = score_plot(source)
            drawn[f"confusion_{name}"] = confusion_plot(source)
    return {name: to_svg(of.figure, name) for name, of in drawn.items()}


def _pour_figures(pour: Pour) -> Figures:
    return {"pour": pour_figure(pour.tree)}


FIGURES: dict[str, Callable[[Any], Figures]] = {
    "calibration": _calibration_figures,
    "criticism": _criticism_figures,
    "pour": _pour_figures,
}
"""Draws the figures of each result."""


def _films(results: Results, compute: Compute) -> dict[str, list[dict[str, str]]]:
    """The films of the latest posterior and the pour: caption, a still and the film, as URLs."""
    from .films import films_of

    shown: dict[str, list[dict[str, str]]] = {}
    for film in films_of(results.latest, results.pour, compute):
        if content := film.path.read_bytes():
            each = {"liquid": str(film.draw), "still": _url(_still(content)), "film": _url(content)}
            shown.setdefault(film.name, []).append(each)
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


def _made_with(results: Results) -> dict[str, str]:
    """Settings, inputs and versions, for a table."""
    record, rows = results.calibration.record, dict[str, Any]()
    settings = dict(record["settings"])
    priors = settings.pop("prior")
    rows |= settings
    rows |= {f"prior of {name}": prior_text(one) for name, one in priors.items()}
    if results.criticism is not None:
        rows |= {f"criticism: {name}": of for name, of in _criticism_rows(results.criticism)}
    if results.pour is not None:
        of_pour = results.pour.tree.attrs
        left_out = ("made_from", "summary", "least_viscosity", "map_error")
        rows |= {f"pour: {name}": of for name, of in of_pour.items() if name not in left_out}
    hashes = zip(record["files"]["recordings"], record["inputs"]["sha256"], strict=True)
    rows |= {f"{file}, SHA-256": digest for file, digest in hashes}
    rows |= record["versions"]
    return {name: str(value) for name, value in rows.items()}


def _criticism_rows(criticism: Criticism) -> list[tuple[str, str]]:
    """Settings of a criticism, and each of its files with its hash."""
    made_from = criticism.made_from
    settings = {"version": made_from["version"], **made_from["settings"]}
    rows = [
        (key, ", ".join(map(str, value)) if isinstance(value, list) else str(value))
        for key, value in settings.items()
    ]
    for group in ("held_out", "baseline", "pours", "held_out_pours"):
        label, given = spoken(group), made_from[group].items()
        rows += [(f"{label} {name}, SHA-256", digest) for name, digest in given]
        rows += [] if given else [(label, "none")]
    return rows


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
