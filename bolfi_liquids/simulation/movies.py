"""Movies of a simulated stir or pour, and failures of a simulation as errors."""

import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..inputs.described_liquid import Described
from ..inputs.recording import Recording
from ..movie.file import PICTURE_RATE, write_movie
from ..progress import progress_bar

if TYPE_CHECKING:
    from ..models import Cups, Landings, PourAction, StirSetup


def film_stir(
    movie: Path, described: Described, recording: Recording, setup: "StirSetup", progress: bool
) -> None:
    """Simulate a stir again, and write what it looks like."""
    from .. import models
    from ..movie.stir import stir_pictures

    with failures_raised():
        frames = models.stir_frames(
            described.liquid(),
            recording.gripper,
            setup,
            described.seed,
            rate=PICTURE_RATE,
            effects=described.effects,
        )
    lines = described.lines()
    caption = [*lines[:2], f"{recording.path.name}, {lines[2]}"]
    _write(movie, stir_pictures(frames, setup, caption), len(frames.time), progress)


def film_pour(
    movie: Path,
    described: Described,
    cups: "Cups",
    action: "PourAction",
    landings: "Landings",
    progress: bool,
) -> None:
    """Simulate a pour again, and write what it looks like."""
    from .. import models
    from ..movie.pour import pour_pictures

    rate, distance = (float(np.asarray(x)) for x in (action.angular_velocity, action.distance))
    with failures_raised():
        batch = models.PourBatch(
            described.liquid(),
            rate,
            cups,
            [described.seed],
            described.particles,
            described.effects,
        )
        frames = models.pour_frames(batch, rate=PICTURE_RATE)
    turn = f"{np.degrees(rate):g}°/s, lip to axis {100 * distance:g} cm"
    pictures = pour_pictures(frames, landings, cups, distance, [*described.lines(), turn])
    _write(movie, pictures, len(frames.time), progress)


def _write(path: Path, pictures: Iterable[NDArray], count: int, progress: bool) -> None:
    with progress_bar("drawing", count, shown=progress) as advance:

        def counted() -> Iterator[NDArray]:
            for picture in pictures:
                yield picture
                advance(1)

        write_movie(path, counted())


@contextmanager
def failures_raised() -> Iterator[None]:
    """Inside, a simulation that goes wrong is an error.

    Raises:
        RuntimeError: It went wrong.
    """
    from ..models import FailedSimulation

    with warnings.catch_warnings():
        warnings.simplefilter("error", FailedSimulation)
        try:
            yield
        except FailedSimulation as err:
            raise RuntimeError(str(err)) from None
