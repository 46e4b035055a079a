"""Prose about a run's facts, from `data/prose.jinja`; page and terminal share it."""

import re
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from ..wording import listed

if TYPE_CHECKING:
    from jinja2 import Environment

PARAGRAPHS = re.compile(r"\n\s*\n")


def prose(part: str, facts: Mapping[str, Any]) -> list[str]:
    """Paragraphs of one part, each of single spaces; parts without anything to say have none.

    Args:
        part: A macro of the template.
        facts: By chapter, see `reporting.facts`; those that the macro names must be there.
    """
    macro = getattr(_template(), part)
    text = macro(**{chapter: facts[chapter] for chapter in macro.arguments})
    return [
        " ".join(paragraph.split()) for paragraph in PARAGRAPHS.split(text) if paragraph.strip()
    ]


@cache
def _template() -> Any:
    # not escaped: a page escapes whole paragraphs
    return templates(autoescape=False).get_template("prose.jinja").module


def templates(*, autoescape: bool) -> "Environment":
    """The package's templates, in which a missing fact is an error."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("bolfi_liquids", "data"),
        autoescape=autoescape,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["listed"] = listed
    return environment
