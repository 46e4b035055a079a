"""Rigs that a person gives."""

from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import Argument
from ..files import as_path
from .toml_file import opened

if TYPE_CHECKING:
    from ..hardware import Rig

CURE = "a TOML file, or what hardware.open_rig returns"


def rig_of(given: "Rig | str | Path | None", motion: str | Path | None = None) -> "Rig":
    """A rig as it is, the rig of a file, or the bundled one for None.

    Args:
        given: The rig.
        motion: A file of fields of [stirring] that take the place of the rig's.

    Raises:
        InputError: Something else was given.
        RigError: A file or a number cannot be used, or the rig does not allow the motion.
    """
    from ..hardware import Rig, bundled_rig, open_rig, with_motion
    from ..hardware.rig_file import checked_rig

    if given is None:
        rig = bundled_rig()
    else:
        rig = opened(given, Rig, open_rig, "rig", "rig", CURE)
    if motion is not None:
        return with_motion(rig, as_path(motion, Argument("motion")))
    return checked_rig(rig) if rig is given else rig
