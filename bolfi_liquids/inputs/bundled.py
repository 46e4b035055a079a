"""Recordings and pours of reference solvers that come with the package."""

from importlib.resources import as_file, files
from typing import TYPE_CHECKING

from .open import open_recording
from .recording import Recording

if TYPE_CHECKING:
    from .pour_table import PourTable

RECORDED_LIQUIDS = ("water", "oil", "glycerin", "gel")
POURED_LIQUIDS = ("water", "glycerin")


def bundled_recording(liquid: str) -> Recording:
    """Stirred at 10 cm/s; one of `RECORDED_LIQUIDS`."""
    with as_file(files("bolfi_liquids.data") / f"{liquid}_v10.nc") as path:
        return open_recording(path)


def bundled_pours(liquid: str) -> "PourTable":
    """Poured with the bundled cups, glycerin held 1.2 s longer; one of `POURED_LIQUIDS`."""
    from .pour_table import open_pours

    with as_file(files("bolfi_liquids.data") / "pours.csv") as path:
        return open_pours(path, liquid)
