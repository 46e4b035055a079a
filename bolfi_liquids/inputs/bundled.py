"""Recordings, pours and templates that come with the package."""

from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING

from ..files import new_file
from .open import open_recording
from .recording import Recording

if TYPE_CHECKING:
    from .pour_table import PourTable

RECORDED_LIQUIDS = ("water", "oil", "glycerin", "gel")
POURED_LIQUIDS = ("water", "glycerin")
TEMPLATES = {"columns.toml": "bolfi_liquids.data", "rig.toml": "bolfi_liquids.hardware.data"}


def bundled_recording(liquid: str) -> Recording:
    """Stirred at 10 cm/s; one of `RECORDED_LIQUIDS`."""
    with as_file(files("bolfi_liquids.data") / f"{liquid}_v10.nc") as path:
        return open_recording(path)


def bundled_pours(liquid: str) -> "PourTable":
    """Poured with the bundled cups, glycerin held 1.2 s longer; one of `POURED_LIQUIDS`."""
    from .pour_table import open_pours

    with as_file(files("bolfi_liquids.data") / "pours.csv") as path:
        return open_pours(path, liquid)


def write_template(name: str, path: str | Path) -> Path:
    """Write one of `TEMPLATES`, to be changed into one's own.

    Raises:
        InputError: There is a file already, or none can be made there.
        FileExistsError: Somebody has made one in between; it stays as it is.
    """
    target = new_file(path, "FILE", replace=False)
    with target.open("x", encoding="utf-8") as file:
        file.write((files(TEMPLATES[name]) / name).read_text(encoding="utf-8"))
    return target
