"""One stir or one pour of a liquid that a person describes: its numbers, and its movie."""

import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import write_netcdf
from ..inputs.described_liquid import Described
from ..inputs.recording import Recording
from ..movie.file import RATE, write_movie
from ..pouring.spillage import FRACTIONS
from ..progress import progress_bar
from .files import check_targets, pour_dataset, stir_dataset

if TYPE_CHECKING:
    from ..models import Cups

DISTANCES = -0.5, 0.5  # m, between lip and receiver, that are no slip of the unit


def simulate_stir(
    described: Described,
    recording: Recording,
    *,
    movie: Path | None = None,
    out: Path | None = None,
    progress: bool = True,
) -> NDArray[np.float64]:
    """Repeat a recording's path in a liquid.

    Args:
        described: The liquid.
        recording: Whose path and rig are used.
        movie: File to show it in; .mp4, .gif or .webp.
        out: File of the simulated recording, .nc: one that can be calibrated on.
        progress: Whether to show a bar on stderr.

    Returns:
        Inclination in the xz and yz planes at the recording's times [rad], shape (T, 2).

    Raises:
        InputError, ImportError: Something given cannot be used; nothing was simulated.
        RuntimeError: The simulation went wrong.
    """
    from .. import models

    check_targets(movie, out)
    if out is not None and out.exists() and out.samefile(recording.path):
        raise InputError("is the recording itself", where=str(out), fix="choose another name")
    setup = models.StirSetup.from_recording(recording, particles=described.particles)
    given = described.liquid(), recording.gripper, setup
    with _failing():
        angles = models.stir(*given, [described.seed], described.effects)[0]
    if out is not None:
        write_netcdf(stir_dataset(described, recording, angles), out)
    if movie is not None:
        from ..movie.stir import stir_pictures

        frames = models.stir_frames(*given, described.seed, rate=RATE, effects=described.effects)
        caption = [*described.lines()[:2], f"{recording.path.name}, {described.lines()[2]}"]
        _film(movie, stir_pictures(frames, setup, caption), len(frames.time), progress)
    return angles


def simulate_pour(  # noqa: PLR0913  one for each option
    described: Described,
    cups: "Cups",
    angular_velocity: float,
    distance: float,
    *,
    movie: Path | None = None,
    out: Path | None = None,
    progress: bool = True,
) -> dict[str, float]:
    """Pour a liquid.

    Args:
        described: The liquid.
        cups: Source and receiver.
        angular_velocity: Of the source [rad/s].
        distance: From its lip to the receiver's axis [m].
        movie, out, progress: As for `simulate_stir`.

    Returns:
        Fractions of the liquid: spilled, received, retained.

    Raises:
        InputError, ImportError: Something given cannot be used; nothing was simulated.
        RuntimeError: The simulation went wrong.
    """
    from .. import models
    from ..models.pouring import FASTEST, SLOWEST

    check_targets(movie, out)
    if not DISTANCES[0] <= distance <= DISTANCES[1]:
        raise InputError(f"{100 * distance:g}", where="--distance", fix="give it in cm")
    if not SLOWEST <= angular_velocity <= FASTEST:
        low, high = np.degrees([SLOWEST, FASTEST])
        raise InputError(
            f"{np.degrees(angular_velocity):g}",
            where="--angular-velocity",
            fix=f"give {low:.2g} to {high:.4g} deg/s",
        )
    given = described.liquid(), angular_velocity, cups
    with _failing():
        try:
            landings = models.landings(
                *given, [described.seed], described.particles, described.effects
            )
        except ValueError as err:
            raise InputError(str(err), where="pour", fix="see simulate pour --help") from err
    result = landings.into(distance, cups.receiver.radius)
    fractions = {name: float(getattr(result, name)[0]) for name in FRACTIONS}
    if out is not None:
        write_netcdf(pour_dataset(described, landings, given[1:], distance, fractions), out)
    if movie is not None:
        from ..movie.pour import pour_pictures

        frames = models.pour_frames(
            *given,
            described.seed,
            rate=RATE,
            particles=described.particles,
            effects=described.effects,
        )
        turn = f"{np.degrees(angular_velocity):g}°/s, lip to axis {100 * distance:g} cm"
        pictures = pour_pictures(frames, landings, cups, distance, [*described.lines(), turn])
        _film(movie, pictures, len(frames.time), progress)
    return fractions


def _film(path: Path, pictures: Iterable[NDArray], count: int, progress: bool) -> None:
    with progress_bar("drawing", count, shown=progress) as advance:

        def counted() -> Iterator[NDArray]:
            for picture in pictures:
                yield picture
                advance(1)

        write_movie(path, counted())


@contextmanager
def _failing() -> Iterator[None]:
    """Inside, a simulation that goes wrong is an error."""
    from ..models import FailedSimulation

    with warnings.catch_warnings():
        warnings.simplefilter("error", FailedSimulation)
        try:
            yield
        except FailedSimulation as err:
            raise RuntimeError(str(err)) from None
