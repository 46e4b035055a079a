"""What the command line prints of a calibration, a criticism, a pour, a rig and a recording."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from ..reporting import criticism_sentences as criticism
from ..reporting.sentences import (
    UNITS,
    emulator_sentences,
    floor_sentence,
    sampler_sentence,
)

if TYPE_CHECKING:
    from xarray import Dataset

    from ..hardware import Check
    from ..inputs.recording import Recording


def print_calibration(section: Mapping[str, Any], console: Console) -> None:
    """The posterior as a table, and how it was come by; from the section "calibrate"."""
    table = _table("parameter", "mean", "sd", "5 %", "50 %", "95 %", "closest")
    for name, values in section["parameters"].items():
        numbers = [values[key] for key in ("mean", "sd", "q05", "q50", "q95")]
        row = [*numbers, section["closest"][name]]
        table.add_row(f"{name} {UNITS.get(name, '')}".strip(), *(f"{v:.3g}" for v in row))
    seconds = section["seconds"]
    console.print(table)
    console.print(
        f"closest hypothesis: {section['fit_rms_deg']:.2f} deg RMS from the recording"
        f" (noise alone: {section['noise_deg']:.2f} deg)\n"
        f"simulations: {section['n_simulations']} to learn from,"
        f" {section['n_check_simulations']} to check with\n"
        f"seconds: simulator {seconds['simulator']:.1f}, engine {seconds['engine']:.1f},"
        f" sampling {seconds['sampling']:.1f}",
        highlight=False,
    )
    if floor := floor_sentence(section):
        console.print(floor, highlight=False, soft_wrap=True)
    for warning in filter(None, [sampler_sentence(section), *emulator_sentences(section)]):
        console.print(f"warning: {warning}", highlight=False, markup=False, soft_wrap=True)


def print_pour(section: Mapping[str, Any], console: Console) -> None:
    """The chosen pour beside the plug-in; from the section "pour"."""
    table = _table("pour", "deg/s", "cm", "expected spillage", "95 % of outcomes below")
    for label, action in (("chosen", section), ("at theta* alone", section["plug_in"])):
        table.add_row(
            label,
            f"{action['angular_velocity_deg_s']:.1f}",
            f"{action['distance_cm']:.2f}",
            f"{action['expected_spillage']:.2%}",
            f"{action['spillage_q95']:.2%}",
        )
    console.print(table)
    console.print(f"simulations: {section['n_simulations']} pours", highlight=False)


def print_criticism(
    section: Mapping[str, Any], effects: "Dataset | None", console: Console
) -> None:
    """The verdict, its evidence and what to do next; from the section "criticise".

    Args:
        section: Of summary.json.
        effects: The group of that name; without it, nothing is said of those that nearly explain.
        console: Where to print.
    """
    lines = [
        criticism.verdict_sentence(section),
        criticism.baseline_sentence(section),
        criticism.considered_sentence(section),
        criticism.accepted_sentence(section),
    ]
    lines += [
        f"{criticism.words(name)}: {criticism.interval(name, values)}"
        for name, values in section["parameters"].items()
        if section["accepted"]
    ]
    lines += _gap_lines(section["gap_deg"])
    lines += [
        f"surest {criticism.window(found)}: {found['rms_deg']:.2f} deg RMS"
        for found in section["where"][: criticism.NAMED]
    ]
    if effects is not None:
        lines.append(criticism.seen_sentence(effects))
    if section["verdict"] in ("tie", "unknown") and effects is not None:
        if nearest := criticism.best_gains(effects):
            lines.append(f"explain most: {'; '.join(nearest)}")
    if section["pours"] is not None:
        lines += [criticism.stirs_sentence(section), criticism.pours_sentence(section["pours"])]
    if section["suggestions"]:
        lines.append(criticism.suggestion_sentence(section))
    for line in filter(None, lines):
        console.print(line, highlight=False, markup=False)


def _gap_lines(gap: Mapping[str, float | None]) -> list[str]:
    """Beyond noise, before and after, on the data and on those held out."""
    rows = {
        "gap beyond noise": ("before", "after"),
        "held out": ("held_out_before", "held_out_after"),
    }
    lines = []
    for label, (before, after) in rows.items():
        if gap[before] is None:
            continue
        then = "" if gap[after] is None else f", after {gap[after]:.2f} deg"
        own = gap["held_out_noise" if label == "held out" else "noise"]
        lines.append(f"{label}: before {gap[before]:.2f} deg RMS{then} (noise: {own:.2f} deg)")
    return lines


def _table(label: str, *numbers: str) -> Table:
    return Table(label, *(Column(heading, justify="right") for heading in numbers))


def print_checks(checks: "Sequence[Check]", console: Console) -> None:
    """What works and what is missing, one line each."""
    table = Table("what", "", "how")
    for check in checks:
        table.add_row(check.name, "ok" if check.ok else "[bold red]no[/]", escape(check.text))
    console.print(table)


def print_recording(recording: "Recording", console: Console) -> None:
    """How long a recording is, how it went, and what can be done with it."""
    seen = np.isfinite(recording.inclination).all(axis=1)
    largest = np.degrees(np.nanmax(np.abs(recording.inclination)))
    console.print(
        f"{recording.path}: {recording.attrs['status']}, {recording.time[-1]:.1f} s, "
        f"{seen.mean():.0%} of the samples with both views, inclination up to {largest:.1f} deg",
        highlight=False,
        soft_wrap=True,
    )
    console.print(
        f"next: bolfi-liquids calibrate {recording.path} --out RUN", highlight=False, soft_wrap=True
    )
