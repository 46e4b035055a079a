"""What a single simulation leaves: files that are checked before it, and written after it."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from numpy.typing import NDArray

from ..files import new_file, new_netcdf
from ..inputs.described_liquid import Described
from ..inputs.recording import Recording, along_path, recording_dataset
from ..movie.file import check_movie

if TYPE_CHECKING:
    from xarray import Dataset

    from ..models import Cups, Landings


def check_targets(movie: Path | None, out: Path | None) -> None:
    """Refuse files that could not be written, before anything is simulated.

    Raises:
        InputError, ImportError: Where and why.
    """
    if movie is not None:
        check_movie(movie)
        new_file(movie)
    if out is not None:
        new_netcdf(out)


def stir_dataset(described: Described, recording: Recording, angles: NDArray) -> "Dataset":
    """The simulated stir as a recording: of the same path, without noise."""
    of_the_original = ("status", "reason")
    rig = {
        name: value
        for name, value in recording.attrs.items()
        if name not in of_the_original and not name.startswith("imported_")
    }
    attrs = {**rig, "path_of": recording.path.name, **described.attributes()}
    return recording_dataset(along_path(recording, angles), attrs)


def pour_dataset(
    described: Described,
    landings: "Landings",
    turned: tuple[float, "Cups"],
    distance: float,
    fractions: Mapping[str, float],
) -> "Dataset":
    """The outcome of a pour, and where each particle passed the height of the receiver's rim."""
    from xarray import Dataset

    angular_velocity, cups = turned
    return Dataset(
        {
            **{name: ((), value, {"units": "1"}) for name, value in fractions.items()},
            "landing": (("particle", "axis"), landings.position[0], {"units": "m"}),
        },
        coords={"axis": ["ahead", "across"]},
        attrs={
            **described.attributes(),
            "angular_velocity": angular_velocity,
            "distance": distance,
            "cups": json.dumps(cups.settings(described.particles)),
        },
    )
