"""Movies of a simulated stir or pour."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..inputs.described_liquid import Described
from ..movie.file import PICTURE_RATE, write_movie
from ..progress import progress_bar
from ..simulators import RATE, PourSimulator, StirSimulator
from .batch import theta_of

if TYPE_CHECKING:
    from ..models import PourAction


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
