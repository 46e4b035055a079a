"""What simulations leave: files that are checked before, data sets, and movies."""

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import Argument, InputError
from ..files import given_path, new_file
from ..inputs.described_liquid import Described
from ..inputs.recording import PLANES, Recording, along_path, recording_dataset
from ..movie.file import PICTURE_RATE, check_movie, write_movie
from ..pouring.spillage import FRACTIONS
from ..progress import progress_bar
from ..simulators import RATE, PourSimulator, StirSimulator
from .batch import Batch, theta_of

if TYPE_CHECKING:
    from xarray import Dataset

    from ..models import Cups, Landings, PourAction


VARIED = ("viscosity", "cohesion", "seed")  # what may differ between simulations of one call


class Targets(NamedTuple):
    """Files that are to be written; None for neither."""

    movie: Path | None
    out: Path | None

    def check_single(self, single: bool) -> None:
        """Refuse files where several liquids are simulated.

        Raises:
            InputError: There are several, and a file was asked for.
        """
        if not single and (self.movie or self.out):
            raise InputError(
                "arrays were given, but a file shows one simulation",
                where=str(self.movie or self.out),
                fix="give numbers, or write what is returned with to_netcdf",
            )


def check_targets(movie: str | Path | None, out: str | Path | None) -> Targets:
    """Refuse files that could not be written, before anything is simulated.

    Raises:
        InputError, ImportError: Where and why.
    """
    if movie is not None:
        movie = given_path(movie, Argument("movie"))
        check_movie(movie)
        new_file(movie, Argument("movie"))
    return Targets(movie, None if out is None else new_file(out, Argument("out"), suffix=".nc"))


def stir_dataset(batch: Batch, recording: Recording, angles: NDArray) -> "Dataset":
    """Simulated stirs as a recording: of the same path, without noise.

    Args:
        batch: The liquids.
        recording: Whose path was simulated.
        angles: Inclinations [rad], shape (simulations, T, 2).
    """
    of_the_original = ("status", "reason")
    rig = {
        name: value
        for name, value in recording.attrs.items()
        if name not in of_the_original and not name.startswith("imported_")
    }
    attrs = {**rig, "path_of": recording.path.name, **_attributes(batch)}
    found = recording_dataset(along_path(recording, angles[0]), attrs)
    if batch.single:
        return found
    planes = {
        name: (("simulation", "time"), angles[..., plane], found[name].attrs)
        for plane, name in enumerate(PLANES)
    }
    return found.assign(planes).assign_coords(_coordinates(batch))


def pour_dataset(
    batch: Batch, landings: "Landings", action: "PourAction", cups: "Cups"
) -> "Dataset":
    """The outcome of pours, and where each particle passed the height of the receiver's rim."""
    from xarray import Dataset

    result = landings.into(action.distance, cups.receiver.radius)
    fractions = {
        name: ("simulation", np.asarray(getattr(result, name)), {"units": "1"})
        for name in FRACTIONS
    }
    landing = (("simulation", "particle", "axis"), landings.position, {"units": "m"})
    found = Dataset(
        {**fractions, "landing": landing},
        coords={"axis": ["ahead", "across"], **_coordinates(batch)},
        attrs={
            **_attributes(batch),
            "angular_velocity": float(np.asarray(action.angular_velocity)),
            "distance": float(np.asarray(action.distance)),
            "cups": json.dumps(cups.settings(batch.one.particles)),
        },
    )
    return found.isel(simulation=0, drop=True) if batch.single else found


def _attributes(batch: Batch) -> dict[str, float | int | str]:
    """What all liquids share."""
    varied = () if batch.single else VARIED
    return {name: v for name, v in batch.one.attributes().items() if name not in varied}


def _coordinates(batch: Batch) -> dict[str, tuple[str, list[float]]]:
    """What tells the simulations apart."""
    return {
        name: ("simulation", [getattr(liquid, name) for liquid in batch.liquids]) for name in VARIED
    }


def film_stir(movie: Path, described: Described, simulator: StirSimulator, progress: bool) -> None:
    """Simulate a stir of one recording again, and write what it looks like."""
    from ..movie.stir import stir_pictures

    (recording,), (setup,) = simulator.recordings, simulator.setups
    frames = simulator.frames(theta_of(described), described.seed, PICTURE_RATE)
    lines = described.lines()
    caption = [*lines[:2], f"{recording.path.name}, {lines[2]}"]
    _write(movie, stir_pictures(frames, setup, caption), len(frames.time), progress)


def film_pour(
    movie: Path,
    described: Described,
    simulator: PourSimulator,
    action: "PourAction",
    progress: bool,
) -> None:
    """Simulate a pour again, and write what it looks like."""
    from ..movie.pour import pour_pictures

    rate, distance = (float(np.asarray(x)) for x in (action.angular_velocity, action.distance))
    theta = {**theta_of(described), RATE: rate}
    frames = simulator.frames(theta, described.seed, PICTURE_RATE)
    turn = f"{np.degrees(rate):g}°/s, lip to axis {100 * distance:g} cm"
    caption = [*described.lines(), turn]
    pictures = pour_pictures(frames, simulator.cups, distance, caption)
    _write(movie, pictures, len(frames.time), progress)


def _write(path: Path, pictures: Iterable[NDArray], count: int, progress: bool) -> None:
    with progress_bar("drawing", count, shown=progress) as advance:

        def counted() -> Iterator[NDArray]:
            for picture in pictures:
                yield picture
                advance(1)

        write_movie(path, counted())
