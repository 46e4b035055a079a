"""Words that the terminal, the report and the figures share: names, units, numbers, sentences.

A sentence is a key and values. Its wording is a Jinja macro of that name in
`data/SUBJECT_sentences.jinja`, so that code and tests speak of conditions and never of wording.
"""

import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

LIQUID_UNITS = {"viscosity": "Pa s"}
"""Units of the liquid's parameters; the others are dimensionless."""

WHOLE_PERCENTS_FROM = 0.1
"""Fraction from which a percentage is written without decimals."""

LEAST_SPILLED = 0.0025
"""Spilled fraction that the map of landings cannot tell from 0: half of one of its parcels. Pours
that are simulated lose a few drops there."""


def spoken(name: str) -> str:
    """The name of an effect or of an explanation as it is written in a sentence."""
    return name.replace("_", " ")


def listed(names: Iterable[str], last: str = "and") -> str:
    """ "a", "a and b", "a, b and c"."""
    words = [spoken(name) for name in names]
    return f" {last} ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def unit_of(name: str) -> str:
    """Unit of an effect's coefficient or of a liquid's parameter; "" if it has none."""
    from .models import EFFECTS

    unit = EFFECTS[name].unit if name in EFFECTS else LIQUID_UNITS.get(name, "")
    return "" if unit == "1" else unit


def with_unit(name: str, value: float) -> str:
    """A coefficient or a parameter to three digits, with its unit."""
    return f"{value:.3g} {unit_of(name)}".strip()


def percent(fraction: float) -> str:
    """A fraction as a percentage of two digits, without decimals above ten."""
    return f"{100 * fraction:{'.0f' if fraction >= WHOLE_PERCENTS_FROM else '.2g'}} %"


def spilled(fraction: float) -> str:
    """A spilled fraction as a percentage."""
    if fraction < LEAST_SPILLED:
        return f"under {percent(LEAST_SPILLED)}"
    return percent(fraction)


def at_most(fraction: float) -> str:
    """An upper bound of the spilled fraction."""
    return spilled(fraction) if fraction < LEAST_SPILLED else f"at most {percent(fraction)}"


def command(*words: object) -> str:
    """A command of this program, to be copied into a shell whatever blanks its paths have."""
    return shlex.join(["bolfi-liquids", *map(str, words)])


def html_table(title: str, rows: Mapping[str, Any]) -> str:
    """A table of two columns for a notebook; its texts are escaped."""
    cells = "".join(
        f"<tr><th style='text-align:left'>{escape(str(name))}</th>"
        f"<td style='text-align:left'>{escape(str(value))}</td></tr>"
        for name, value in rows.items()
    )
    return f"<table><caption>{escape(title)}</caption>{cells}</table>"


@dataclass(frozen=True)
class Sentence:
    """What is to be written, before it is put into words.

    `str(sentence)` is its wording, in a page as on a terminal.

    Attributes:
        key: SUBJECT.NAME: the macro NAME of `data/SUBJECT_sentences.jinja`.
        values: The macro's arguments by name.
    """

    key: str
    values: Mapping[str, Any]

    def __str__(self) -> str:
        subject, _, name = self.key.partition(".")
        macro = getattr(wordings(subject), name)
        return " ".join(macro(**self.values).split())


def sentence(key: str, **values: Any) -> Sentence:
    """The sentence of this key with these values."""
    return Sentence(key, values)


@cache
def wordings(subject: str) -> Any:
    """The macros of a subject's sentences, as attributes."""
    return _environment().get_template(f"{subject}_sentences.jinja").module


@cache
def _environment() -> "Environment":
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("bolfi_liquids", "data"),
        autoescape=False,  # a page escapes the whole sentence
        undefined=StrictUndefined,
    )
    environment.filters |= {
        "spoken": spoken,
        "listed": listed,
        "percent": percent,
        "spilled": spilled,
        "at_most": at_most,
        "digits": lambda value, count=2: f"{value:.{count}g}",
        "fixed": lambda value, decimals=2: f"{value:.{decimals}f}",
        "of": lambda value, name: with_unit(name, value),
    }
    return environment
