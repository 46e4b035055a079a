"""Rigs that a person gives."""

from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError

if TYPE_CHECKING:
    from ..hardware import Rig


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
    if isinstance(given, str | Path):
        return open_rig(given)
    if not isinstance(given, Rig):
        raise InputError(
            f"{given!r:.80} is no rig", where="rig", fix="give the path of a rig.toml, or a Rig"
        )
    return checked_rig(given)
