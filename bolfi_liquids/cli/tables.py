"""What the command line prints of a calibration, a criticism, a pour, a rig and a recording."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from ..inference.criticism.verdict_kind import VerdictKind
from ..reporting import criticism_sentences as criticism
from ..reporting.sentences import fate_sentences, given_sentences, model_error_sentence
from ..wording import LIQUID_UNITS, Sentence, percent, spilled

if TYPE_CHECKING:
    from xarray import Dataset

    from ..calibration.summary import CalibrationSummary
    from ..criticism.summary import CriticismSummary
    from ..hardware import Check
    from ..inputs.recording import Recording
    from ..pouring.result import GivenSummary, PourSummary


def print_calibration(summary: "CalibrationSummary", console: Console) -> None:
    """The posterior as a table, and how it was made."""
    table = _table("parameter", "mean", "sd", "5 %", "50 %", "95 %", "closest")
    for name, values in summary.parameters.items():
        row = [*astuple(values), summary.closest[name]]
        table.add_row(f"{name} {LIQUID_UNITS.get(name, '')}".strip(), *(f"{v:.3g}" for v in row))
    seconds = summary.seconds
    console.print(table)
    console.print(
        f"closest hypothesis: {summary.fit_rms_deg:.2f} deg RMS from the recording"
        f" (noise alone: {summary.noise_deg:.2f} deg)\n"
        f"{model_error_sentence(summary)}\n"
        f"simulations: {summary.n_simulations} to search, {summary.n_check_simulations} to check,"
        f" which {'confirm' if summary.confirmed else 'do not confirm'} the posterior\n"
        f"seconds: simulator {seconds.simulator:.1f}, engine {seconds.engine:.1f},"
        f" sampling {seconds.sampling:.1f}",
        highlight=False,
    )


def print_warnings(sentences: Iterable[Sentence], console: Console) -> None:
    """Each on a line of its own, however long."""
    for sentence in sentences:
        console.print(f"warning: {sentence}", highlight=False, markup=False, soft_wrap=True)


def print_pour(summary: "PourSummary", console: Console) -> None:
    """The chosen pour beside the plug-in."""
    table = _table("pour", "deg/s", "cm", "expected spillage", "95 % of outcomes below")
    for label, action in (("chosen", summary), ("at theta* alone", summary.plug_in)):
        table.add_row(
            label,
            f"{action.angular_velocity_deg_s:.1f}",
            f"{action.distance_cm:.2f}",
            spilled(action.expected_spillage),
            spilled(action.spillage_q95),
        )
    console.print(table)
    if summary.given is not None:
        console.print(_given(summary.given))
    for sentence in (*fate_sentences(summary), *given_sentences(summary)):
        console.print(str(sentence), highlight=False, markup=False)
    error = "" if summary.map_error is None else f", error of their map {summary.map_error:.2%}"
    console.print(f"simulations: {summary.n_simulations} pours{error}", highlight=False)


def _given(given: "GivenSummary") -> Table:
    """The given pours that are most like the choice, beside what the simulator expects of them."""
    table = _table("given pour", "deg/s", "cm", "spilled", "expected by simulator alone")
    for pour in given.nearest:
        table.add_row(
            f"line {pour.line}",
            f"{pour.angular_velocity_deg_s:.1f}",
            f"{pour.distance_cm:.2f}",
            percent(pour.spilled),
            spilled(pour.expected_spillage),
        )
    return table


def print_criticism(
    summary: "CriticismSummary", effects: "Dataset | None", console: Console
) -> None:
    """The verdict, its evidence and what to do next.

    Args:
        summary: Of the criticism.
        effects: The group of that name; without it, nothing is printed of the effects.
        console: Where to print.
    """
    sentences = [
        criticism.verdict_sentence(summary),
        *criticism.baseline_sentences(summary),
        *criticism.considered_sentences(summary),
        *criticism.requested_sentences(summary),
        *criticism.parameter_sentences(summary),
        *criticism.gap_sentences(summary.gap, summary.accepted),
    ]
    if summary.where:
        sentences.append(criticism.where_sentence(summary.where))
    if effects is not None:
        sentences.append(criticism.detectable_sentence(effects))
        if summary.verdict in (VerdictKind.TIE, VerdictKind.UNKNOWN):
            sentences += criticism.largest_gains_sentences(effects)
    if summary.pours is not None:
        sentences += criticism.stirs_sentences(summary)
        sentences += criticism.pours_sentences(summary.pours)
    if summary.suggestions:
        sentences.append(criticism.suggestion_sentence(summary))
    for sentence in sentences:
        console.print(str(sentence), highlight=False, markup=False)


def print_seconds(seconds: Mapping[str, float], console: Console) -> None:
    """Seconds of each phase, and their share."""
    total = sum(seconds.values())
    table = _table("phase", "seconds", "share")
    for phase, spent in (*seconds.items(), ("all", total)):
        table.add_row(phase, f"{spent:.1f}", f"{spent / total:.0%}")
    console.print(table)


def _table(label: str, *numbers: str) -> Table:
    return Table(label, *(Column(heading, justify="right") for heading in numbers))


def print_checks(checks: "Sequence[Check]", console: Console) -> None:
    """What works and what is missing, one line each."""
    table = Table("what", "", "how")
    for check in checks:
        table.add_row(check.name, "ok" if check.ok else "[bold red]no[/]", escape(check.text))
    console.print(table)


def print_recording(recording: "Recording", console: Console) -> None:
    """How long a recording is, and how it went."""
    seen = np.isfinite(recording.inclination).all(axis=1)
    largest = np.degrees(np.nanmax(np.abs(recording.inclination)))
    console.print(
        f"{recording.path}: {recording.attrs['status']}, {recording.time[-1]:.1f} s, "
        f"{seen.mean():.0%} of the samples with both views, inclination up to {largest:.1f} deg",
        highlight=False,
        soft_wrap=True,
    )
