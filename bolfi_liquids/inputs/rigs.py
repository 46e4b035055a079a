"""Rigs that a person gives."""

from pathlib import Path
from typing import TYPE_CHECKING

from .toml_file import opened

if TYPE_CHECKING:
    from ..hardware import Rig

CURE = "a TOML file, or what hardware.open_rig returns"


def rig_of(given: "Rig | str | Path | None") -> "Rig":
    """A rig as it is, the rig of a file, or the bundled one for None.

    Raises:
        InputError: Something else was given.
        RigError: The file or a number cannot be used.
    """
    from ..hardware import Rig, bundled_rig, open_rig
    from ..hardware.rig_file import checked_rig

    if given is None:
        return bundled_rig()
    rig = opened(given, Rig, open_rig, "rig", "rig", CURE)
    return checked_rig(rig) if rig is given else rig
