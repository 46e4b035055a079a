"""The cups a pour is chosen for."""

from collections.abc import Mapping
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Argument, InputError
from .checks import LIMITS
from .toml_file import read_toml

if TYPE_CHECKING:
    from ..models import Cups

BUNDLED = "cups.toml"
LIP_HEIGHTS = 5e-3, 1.0  # [m] of what an arm pours


def bundled_cups() -> "Cups":
    """The cups that come with the package."""
    with as_file(files("bolfi_liquids.data") / BUNDLED) as path:
        return open_cups(path)


def cups_of(given: "Cups | str | Path | None") -> "Cups":
    """Cups as they are, those of a file, or the bundled ones for None.

    Raises:
        InputError: The file cannot be used, something else was given, or nobody pours with them.
    """
    from ..models import Cups

    if given is None:
        return bundled_cups()
    if isinstance(given, str | Path):
        return open_cups(given)
    if not isinstance(given, Cups):
        raise InputError(
            f"{given!r:.80} is no pair of cups",
            where=Argument("cups"),
            fix="give the path of a TOML file, or models.Cups",
        )
    _check_pourable(given, Argument("cups"))
    return given


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

    cups = read_toml(path, Cups, fix="compare with the bundled cups.toml")
    _check_pourable(cups, str(path))
    return cups


def _check_pourable(cups: "Cups", where: str) -> None:
    """Refuse cups that nobody pours with, which the files of older runs may hold.

    Raises:
        InputError: A size is a slip of the unit, or nothing flows over the lip.
    """
    radii, heights = LIMITS["cup_radius"][:2], LIMITS["cup_height"][:2]
    sizes = {
        "source.radius": (cups.source.radius, *radii),
        "receiver.radius": (cups.receiver.radius, *radii),
        "source.height": (cups.source.height, *heights),
        "receiver.height": (cups.receiver.height, *heights),
        "lip_height": (cups.pour.lip_height, *LIP_HEIGHTS),
    }
    for name, (size, least, most) in sizes.items():
        if not least <= size <= most:
            raise InputError(
                f"{name} = {size:g} m is not between {least:g} and {most:g} m",
                where=where,
                fix="measure it again, in m",
            )
    source, angle = cups.source, cups.pour.final_angle_deg
    least = float(np.degrees(np.arctan2(source.height - source.fill, source.radius)))
    if angle <= least:
        raise InputError(
            f"pour.final_angle_deg = {angle:g}: nothing flows over the lip up to {least:.0f} deg",
            where=where,
            fix="turn the source further",
        )
