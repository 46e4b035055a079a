"""What the report shows of a criticism."""

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from ..calibration.summary import CalibrationSummary
from ..criticism.effect_figures import (
    any_fitted,
    coefficient_plot,
    confusion_plot,
    score_plot,
)
from ..criticism.figures import (
    held_out_plot,
    pour_residual_plot,
    residual_plot,
    stroke_plot,
)
from ..criticism.result import Criticism
from ..criticism.summary import CriticismSummary
from ..drawing import to_svg
from ..hover_labels import lines_of, to_chart
from ..wording import Sentence, spoken, unit_of
from . import criticism_sentences as sentences

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

SOURCES = ("stirs", "pours")


def criticism_context(criticism: Criticism) -> dict[str, Any]:
    """What the template needs."""
    summary = criticism.summary
    of = criticism_chapter(summary, criticism.tree, criticism.base.summary)
    return {"summary": summary, **of}


def criticism_chapter(
    summary: CriticismSummary, tree: "DataTree", calibrated: CalibrationSummary
) -> dict[str, Any]:
    """Sentences, figures and tables.

    Args:
        summary: Of the criticism.
        tree: criticism.nc.
        calibrated: Of the calibration that was criticised.
    """
    stirs, accepted = tree.children["stirs"], summary.accepted
    held, residual = held_out_of(stirs), residual_plot(stirs).figure
    return {
        "results": _results(summary, calibrated),
        "superseded": sentences.superseded_sentences(summary),
        "baseline": sentences.baseline_sentences(summary),
        "gap": sentences.gap_sentences(summary.gap, accepted),
        "where": sentences.where_sentence(summary.where),
        "held": sentences.held_out_sentence(held),
        "doubtful_effects": [
            *sentences.undetectable_sentences(stirs["effects"].to_dataset()),
            *sentences.untested_sentences(summary),
        ],
        "suggestion": sentences.suggestion_sentence(summary),
        "noise": sentences.camera_noise_sentence(summary),
        "residual": to_chart(residual, "residual", lines_of(residual)),
        "strokes": to_svg(stroke_plot(stirs).figure, "strokes"),
        "coefficient": to_svg(coefficient_plot(tree, accepted).figure, "coefficient")
        if accepted
        else "",
        "held_out": "" if held is None else to_svg(held_out_plot(stirs).figure, "held-out"),
        "held_rows": [] if held is None else _held_rows(held),
        "suggestions": _suggestion_rows(summary),
        "sources": [
            _effects_part(name, tree.children[name]) for name in SOURCES if name in tree.children
        ],
        "pours": _pours_part(summary, tree),
        "made_with": _made_with(tree),
    }


def held_out_of(node: "DataTree") -> "Dataset | None":
    """The group `held_out` of a source, where it has one."""
    return node["held_out"].to_dataset() if "held_out" in node.children else None


def _results(summary: CriticismSummary, calibrated: CalibrationSummary) -> list[Sentence]:
    """The verdict, and what else stands at the top of the page."""
    return [
        sentences.verdict_sentence(summary),
        *sentences.stirs_sentences(summary),
        *sentences.considered_sentences(summary),
        *sentences.requested_sentences(summary),
        *(sentences.coefficient_sentence(*item) for item in summary.coefficient.items()),
        *sentences.refit_sentences(summary, calibrated.parameters),
    ]


def _held_rows(held: "Dataset") -> list[list[str]]:
    rows = []
    for name in held["explanation"].to_numpy():
        for recording in held["recording"].to_numpy():
            gap = held.sel(explanation=name, recording=recording)
            angles = [np.degrees(float(gap[k])) for k in ("before", "after", "noise", "floor")]
            rows.append(
                [
                    spoken(str(name)),
                    str(recording),
                    *(f"{angle:.2f}" for angle in angles),
                    f"{float(gap['p_value']):.2g}",
                    f"{float(gap['lpd_gain']):.1f}",
                    "yes" if bool(gap["holds"]) else "no",
                ]
            )
    return rows


def _suggestion_rows(summary: CriticismSummary) -> list[list[str]]:
    ranked = sorted(summary.suggestions, key=lambda one: -one.snr)
    return [
        [one.experiment, " or ".join(map(spoken, one.between)), f"{one.snr:.1f}"] for one in ranked
    ]


def _effects_part(name: str, node: "DataTree") -> dict[str, Any]:
    """Scores, likenesses and the table of effects of a source."""
    effects, confusion = (node[group].to_dataset() for group in ("effects", "confusion"))
    return {
        "name": name,
        "scores": to_svg(score_plot(node).figure, f"scores-{name}"),
        "fitted": any_fitted(node),
        "confusion": to_svg(confusion_plot(node).figure, f"confusion-{name}"),
        "rows": [
            _effect_row(str(effect), effects.sel(effect=effect), confusion)
            for effect in effects["effect"].to_numpy()
        ],
    }


def _effect_row(name: str, found: "Dataset", confusion: "Dataset") -> list[str]:
    return [
        spoken(name),
        _number(found["typical"].item(), ".3g", unit_of(name)),
        _number(found["snr"].item(), ".1f"),
        _most_similar(name, confusion),
        _number(found["gain"].item(), ".1f"),
        _number(found["p_value"].item(), ".2g"),
        _number(found["coefficient"].item(), ".3g", unit_of(name)),
        str(found["status"].item()),
    ]


def _number(value: float, form: str, unit: str = "") -> str:
    return f"{value:{form}} {unit}".strip() if np.isfinite(value) else "–"


def _most_similar(name: str, confusion: "Dataset") -> str:
    """The other effect whose signature is most like an effect's, with their cosine."""
    names = [str(other) for other in confusion["effect"].to_numpy()]
    if name not in names or len(names) < 2:
        return "–"
    cosine = confusion["cosine"].sel(effect=name).to_numpy()
    others = np.where(np.array(names) == name, 0.0, np.abs(cosine))
    closest = int(np.argmax(others))
    return f"{spoken(names[closest])} ({cosine[closest]:.2f})"


def _pours_part(summary: CriticismSummary, tree: "DataTree") -> dict[str, Any] | None:
    if summary.pours is None or "pours" not in tree.children:
        return None
    return {
        "sentences": sentences.pours_sentences(summary.pours),
        "figure": to_svg(pour_residual_plot(tree.children["pours"]).figure, "pour-residual"),
    }


def _made_with(tree: "DataTree") -> list[tuple[str, str]]:
    """Settings of a criticism, and each of its files with its hash."""
    made_from = json.loads(tree.attrs["made_from"])
    settings = {"version": made_from["version"], **made_from["settings"]}
    rows = [(key, _text(value)) for key, value in settings.items()]
    for group in ("held_out", "baseline", "pours", "held_out_pours"):
        files = made_from[group].items()
        label = spoken(group)
        rows += [(f"{label} {name}, SHA-256", digest) for name, digest in files] or [
            (label, "none")
        ]
    return rows


def _text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)
