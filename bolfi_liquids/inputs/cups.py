"""The cups a pour is chosen for."""

from collections.abc import Mapping
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Argument
from .toml_file import opened, read_toml, validated

if TYPE_CHECKING:
    from ..models import Cups

FIX = "compare with the bundled cups.toml"


def bundled_cups() -> "Cups":
    """The cups that come with the package."""
    with as_file(files("bolfi_liquids.data") / "cups.toml") as path:
        return open_cups(path)


def cups_of(given: "Cups | str | Path | None") -> "Cups":
    """Cups as they are, those of a file, or the bundled ones for None.

    Raises:
        InputError: The file cannot be used, or something else was given.
    """
    from ..models import Cups

    if given is None:
        return bundled_cups()
    cups = opened(given, Cups, open_cups, Argument("cups"), "pair of cups", "a TOML file")
    if cups is given:  # copies may hold what no file may
        return validated(cups.model_dump(), Cups, "cups", FIX)
    return cups


def kept_cups(settings: Mapping[str, Any]) -> "Cups":
    """The cups whose `Cups.settings` a result holds."""
    from ..models import Cups

    return Cups.model_validate({name: settings[name] for name in Cups.model_fields})


def open_cups(path: str | Path) -> "Cups":
    """Read cups that a person wrote down.

    Raises:
        InputError: The file is missing or cannot be used; the message says why.
    """
    from ..models import Cups

    return read_toml(path, Cups, fix=FIX)
