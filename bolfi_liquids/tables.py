"""What the command line prints of a calibration and of a pour."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Column, Table

from .narrative import floor_sentence, sampler_sentence

UNITS = {"viscosity": "Pa s", "cohesion": ""}


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
    if warning := sampler_sentence(section):
        console.print(f"warning: {warning}", highlight=False, soft_wrap=True)


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


def _table(label: str, *numbers: str) -> Table:
    return Table(label, *(Column(heading, justify="right") for heading in numbers))
