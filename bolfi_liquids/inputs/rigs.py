"""Rigs as the command line meets them: read, written as a template."""

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..files import given_path, new_file, write_new_text

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


def write_template(path: str | Path) -> Path:
    """Write the bundled rig.toml.

    Raises:
        InputError: There is a file already.
    """
    path, fix = given_path(path, "FILE"), "name a file that does not"
    if path.exists():
        raise InputError("exists already", where=str(path), fix=fix)
    text = (files("bolfi_liquids.hardware.data") / "rig.toml").read_text(encoding="utf-8")
    try:
        return write_new_text(new_file(path), text)
    except FileExistsError:
        raise InputError("exists already", where=str(path), fix=fix) from None
