"""Stirs and pours of liquids that a person describes, as tables, files and movies."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import Argument, InputError
from ..files import given_path, new_file, write_netcdf
from ..inference.arguments import checked_array
from ..inputs.bundled import bundled_recording
from ..inputs.cups import cups_of
from ..inputs.described_liquid import COHESION, DENSITY, VISCOSITY, Described, check_effects
from ..inputs.limits import checked_number
from ..inputs.open import Source, open_recordings
from ..inputs.pour_table import check_distance, check_rate
from ..inputs.recording import (
    LENGTHS,
    PLANES,
    STICK_WEIGHT,
    Recording,
    along_path,
    planned_recording,
    recording_dataset,
)
from ..movie.file import PICTURE_RATE, check_movie, write_movie
from ..pouring.spillage import FRACTIONS
from ..progress import progress_bar
from ..run.compute import open_compute
from ..simulators import RATE, BatchOf, FluidSimulator, PourSimulator, StirSimulator

if TYPE_CHECKING:
    from xarray import Dataset

    from ..inference.simulations import Compute, Workers
    from ..models import Cups
    from ..models.trajectory import PivotPath

RIG_SIZES = (*LENGTHS, *STICK_WEIGHT)  # attributes of a recording that may be replaced
PATTERN_SPEED = 0.1  # m/s, of a star or circle that is given by its name
OF_THE_ORIGINAL = ("status", "reason")  # attributes of a recording that its simulation lacks
VARIED = ("viscosity", "cohesion", "seed")  # what may differ between simulations of one call
Liquids = NDArray[Any]
"""`Described` liquids, one for each simulation: shape (B,), or () where only numbers were given."""


def simulate_stir(  # noqa: PLR0913  the one call that most users make
    viscosity: ArrayLike = VISCOSITY,
    cohesion: ArrayLike = COHESION,
    *,
    density: float | None = None,
    effects: Mapping[str, float] | None = None,
    path: "str | PivotPath | None" = None,
    rig: Mapping[str, float] | None = None,
    recording: Source | None = None,
    particles: int = 0,
    seed: ArrayLike = 0,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    movie: str | Path | None = None,
    out: str | Path | None = None,
    progress: bool = True,
) -> "Dataset":
    """Simulate how a liquid inclines the stick that stirs it.

    Give arrays to simulate several liquids, or one with several seeds, in one call.

    Args:
        viscosity: Viscosity of the liquid [Pa s]; a number or shape (B,).
        cohesion: Cohesion of the liquid, 0 to 1; a number or shape (B,).
        density: Density of the liquid [kg/m3]; None is the recording's.
        effects: Coefficients of `models.EFFECTS` by name.
        path: "star" or "circle", at 10 cm/s, or a path such as `hardware.motion.star(speed=0.05,
            height=0.235)` returns; None is the recording's.
        rig: Sizes of cup and stick [m], and `stick_mass` [kg] or `stick_density` [kg/m3], by the
            names of a recording's attributes, in place of the recording's.
        recording: Whose path and rig are used, or its file; None is a bundled stir of glycerin.
        particles: Number of particles of the simulated liquid; 0: cells follow the stick.
        seed: Seed of the packing; an integer or shape (B,).
        executor, timeout: See `calibrate`.
        movie: File to show it in; .mp4, .gif or .webp.
        out: File of the simulated recording, .nc: one that can be calibrated on.
        progress: Whether to show a bar on stderr while a movie is drawn.

    Returns:
        The fields of a recording over `time`: the gripper's `x`, `y` and `z` [m],
        `inclination_xz` and `inclination_yz` [rad]; these two over (simulation, time) where an
        array was given.

    Raises:
        InputError, ImportError: Something given cannot be used; nothing was simulated.
        RuntimeError: The simulation went wrong.
    """
    from ..models import StirSetup

    weighed = None if density is None else checked_number(density, Argument("density"))
    liquids = described_liquids(
        {"viscosity": viscosity, "cohesion": cohesion, "seed": seed},
        density=DENSITY if weighed is None else weighed,
        effects=check_effects(effects, "stir"),
        particles=particles,
    )
    movie, out = _checked_files(movie, out, liquids)
    (opened,) = open_recordings(bundled_recording("glycerin") if recording is None else recording)
    if out is not None and out.exists() and out.samefile(opened.path):
        raise InputError("is the recording itself", where=str(out), fix="choose another name")
    if weighed is None:
        weighed = opened.number("liquid_density")
    attrs = _with_rig(opened.attrs, rig) | {"liquid_density": weighed}
    plan = _planned(replace(opened, attrs=attrs), path)
    count = particles or StirSetup.from_recording(plan).particles
    liquids = _replaced(liquids, density=weighed, particles=count)
    setup = StirSetup.from_recording(plan, particles=liquids.flat[0].particles)
    simulator = StirSimulator((plan,), (setup,))
    with open_compute(executor, timeout) as compute:
        angles = simulated(simulator, liquids, compute)
    kept = {
        name: value
        for name, value in plan.attrs.items()
        if name not in OF_THE_ORIGINAL and not name.startswith("imported_")
    }
    planes = {
        name: (("simulation", "time"), angles[..., plane], {"units": "rad"})
        for plane, name in enumerate(PLANES)
    }
    made = recording_dataset(along_path(plan, angles[0]), kept | {"path_of": plan.path.name})
    made = _told_apart(made.assign(planes), liquids)
    if out is not None:
        write_netcdf(made, out)
    if movie is not None:
        from ..movie.stir import stir_pictures

        one = liquids.item()
        frames = simulator.frames(theta_of(one), one.seed, PICTURE_RATE)
        *liquid, how = one.lines()
        pictures = stir_pictures(frames, setup, [*liquid, f"{plan.path.name}, {how}"])
        _film(movie, pictures, len(frames.time), progress)
    return made


@dataclass(frozen=True)
class LandedParticles:
    """The retained fraction, then the landing of each particle [m]: (B, 1 + 2 particles).

    Attributes:
        angular_velocity: Angular velocity of the source [rad/s].
    """

    angular_velocity: float

    def __call__(
        self, batch: BatchOf, theta: Mapping[str, NDArray], seeds: NDArray
    ) -> NDArray[np.float64]:
        from .. import models

        landed = models.landings(*batch({**theta, RATE: self.angular_velocity}, seeds))
        return np.column_stack([landed.retained, landed.position.reshape(len(seeds), -1)])

    @property
    def settings(self) -> list[Any]:
        """The angular velocity."""
        return ["landings", self.angular_velocity]


def simulate_pour(  # noqa: PLR0913  the one call that most users make
    viscosity: ArrayLike = VISCOSITY,
    cohesion: ArrayLike = COHESION,
    *,
    angular_velocity: float = np.radians(60.0),
    distance: float = 0.03,
    density: float = DENSITY,
    effects: Mapping[str, float] | None = None,
    cups: "Cups | str | Path | None" = None,
    particles: int = 0,
    seed: ArrayLike = 0,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    movie: str | Path | None = None,
    out: str | Path | None = None,
    progress: bool = True,
) -> "Dataset":
    """Simulate a pour from one cup into another.

    Args:
        viscosity, cohesion, effects, seed: See `simulate_stir`.
        angular_velocity: Angular velocity of the source about its lip [rad/s].
        distance: Distance from the source's lip to the receiver's axis [m].
        density: Density of the liquid [kg/m3].
        cups: Source and receiver, or a TOML file of them; None are the bundled ones.
        particles: Number of particles of the simulated liquid; 0: cells follow the cup.
        executor, timeout, movie, progress: See `simulate_stir`.
        out: File of the result, .nc.

    Returns:
        The fractions `spilled`, `received` and `retained`, and `landing` (particle, axis) [m]:
        where each particle passes the height of the receiver's rim; all over `simulation` first
        where an array was given.

    Raises:
        InputError, ImportError: Something given cannot be used; nothing was simulated.
        RuntimeError: The simulation went wrong.
    """
    cups = cups_of(cups)
    distance_at, rate_at = Argument("distance"), Argument("angular_velocity")
    distance = checked_number(distance, distance_at)
    rate = checked_number(angular_velocity, rate_at)
    check_distance(distance, cups, distance_at)
    check_rate(rate, cups, rate_at)
    liquids = described_liquids(
        {"viscosity": viscosity, "cohesion": cohesion, "seed": seed},
        density=checked_number(density, Argument("density")),
        effects=check_effects(effects, "pour"),
        particles=particles,
    )
    movie, out = _checked_files(movie, out, liquids)
    from xarray import Dataset

    from ..models import Landings

    one = liquids.flat[0]
    simulator = PourSimulator(cups, one.density, LandedParticles(rate), particles=one.particles)
    with open_compute(executor, timeout) as compute:
        signals = simulated(simulator, liquids, compute)
    position = signals[:, 1:].reshape(len(signals), -1, 2).astype(np.float32)
    result = Landings(position, signals[:, 0]).into(distance, cups.receiver.radius)
    made = Dataset(
        {
            **{name: ("simulation", getattr(result, name), {"units": "1"}) for name in FRACTIONS},
            "landing": (("simulation", "particle", "axis"), position, {"units": "m"}),
        },
        coords={"axis": ["ahead", "across"]},
        attrs={
            "angular_velocity": rate,
            "distance": distance,
            "cups": json.dumps(cups.settings(one.particles)),
        },
    )
    made = _told_apart(made, liquids)
    if out is not None:
        write_netcdf(made, out)
    if movie is not None:
        from ..movie.pour import pour_pictures

        frames = simulator.frames(theta_of(one) | {RATE: rate}, one.seed, PICTURE_RATE)
        turn = f"{np.degrees(rate):g}°/s, lip to axis {100 * distance:g} cm"
        pictures = pour_pictures(frames, cups, distance, [*one.lines(), turn])
        _film(movie, pictures, len(frames.time), progress)
    return made


def described_liquids(values: Mapping[str, ArrayLike], **shared: Any) -> Liquids:
    """Liquids of which each value is a number, or an array of one for each simulation.

    Args:
        values: By the names of `VARIED`.
        **shared: The other fields of `Described`, the same for all.

    Raises:
        InputError: A value cannot be used, or arrays differ in length.
    """
    columns = {name: _column(name, value) for name, value in values.items()}
    shapes = {column.shape for column in columns.values()} - {()}
    if len(shapes) > 1:
        given = {name: column.shape for name, column in columns.items()}
        fix = "give numbers, or arrays of one length"
        raise InputError(f"shapes {given}", where="simulate", fix=fix)

    def one(*of_one: Any) -> Described:
        return Described(**dict(zip(columns, of_one, strict=True)), **shared)

    return np.vectorize(one, otypes=[object])(*columns.values())


def _column(name: str, value: ArrayLike) -> NDArray:
    """`value` as an array, shape () or (B,); `Described` looks at each seed."""
    fix = "give a number, or an array of them"
    try:
        seeds = name == "seed"
        column = np.asarray(value, dtype=object) if seeds else checked_array(name, value)
    except ValueError as err:
        raise InputError(f"{value!r:.80}", where=Argument(name), fix=fix) from err
    if column.ndim > 1:
        what = f"an array of {column.ndim} dimensions"
        raise InputError(what, where=Argument(name), fix="give a number, or an array of one")
    if not column.size:
        raise InputError("no simulation", where=Argument(name), fix="give at least one value")
    return column


def _replaced(liquids: Liquids, **changes: Any) -> Liquids:
    """All of the liquids with other values of these fields."""
    return np.vectorize(lambda one: replace(one, **changes), otypes=[object])(liquids)


def theta_of(described: Described) -> dict[str, float]:
    """Parameters of a described liquid, and the coefficients of its effects."""
    liquid = {"viscosity": described.viscosity, "cohesion": described.cohesion}
    return liquid | dict(described.effects)


def simulated(simulator: FluidSimulator, liquids: Liquids, compute: "Compute") -> NDArray:
    """Signals of all liquids, shape (simulations, ...).

    Args:
        simulator: Of stirs or pours; the first number of a signal is finite unless it failed.
        liquids: Their density is the simulator's.
        compute: Where simulations run.

    Raises:
        RuntimeError: A simulation failed.
    """
    from ..inference.simulations import Job, run_missing

    jobs = [Job(theta_of(one), one.seed) for one in liquids.flat]
    made, signals = run_missing(simulator.batched, jobs, compute), []
    for job, one in zip(jobs, made, strict=True):
        if one.signal is None or not np.isfinite(one.signal.flat[0]):
            why = one.error or "its result is not finite"
            raise RuntimeError(f"the simulation of {job.theta} failed: {why}")
        signals.append(one.signal)
    return np.stack(signals)


def described(made: "Dataset") -> Described:
    """The liquid that was simulated for a table of one simulation."""
    read = {name: made.attrs[name] for name in ("viscosity", "cohesion", "particles", "seed")}
    effects = json.loads(made.attrs["effects"])
    return Described(**read, density=made.attrs["liquid_density"], effects=effects)


def _told_apart(made: "Dataset", liquids: Liquids) -> "Dataset":
    """A table with its liquids: what differs is over `simulation`, the rest are attributes.

    Where only numbers were given there is no axis of simulations.
    """
    attributes = liquids.flat[0].attributes()
    if liquids.ndim == 0:
        return made.isel(simulation=0, drop=True).assign_attrs(attributes)
    varied = {name: [getattr(one, name) for one in liquids] for name in VARIED}
    shared = {name: value for name, value in attributes.items() if name not in VARIED}
    return made.assign_attrs(shared).assign_coords(
        {name: ("simulation", values) for name, values in varied.items()}
    )


def _checked_files(
    movie: str | Path | None, out: str | Path | None, liquids: Liquids
) -> tuple[Path | None, Path | None]:
    """Refuse a movie and a table that could not be written, before anything is simulated."""
    if movie is not None:
        movie = given_path(movie, Argument("movie"))
        check_movie(movie)
        new_file(movie, Argument("movie"))
    if out is not None:
        out = new_file(out, Argument("out"), suffix=".nc")
    if liquids.ndim and (movie or out):
        raise InputError(
            "arrays were given, but a file shows one simulation",
            where=str(movie or out),
            fix="give numbers, or write what is returned with to_netcdf",
        )
    return movie, out


def _with_rig(
    attrs: Mapping[str, float | str], rig: Mapping[str, float] | None
) -> dict[str, float | str]:
    """A recording's attributes with those of a rig in their place."""
    sizes = {} if rig is None else rig
    if not isinstance(sizes, Mapping):
        raise InputError(f"{rig!r:.80}", where=Argument("rig"), fix="give sizes by name")
    weights = [name for name in STICK_WEIGHT if name in sizes]
    fix = f"give positive {', '.join(LENGTHS)}, and {' or '.join(STICK_WEIGHT)}"
    for name, value in sizes.items():
        if name not in RIG_SIZES:
            raise InputError(f"{name!s:.80} is no size of a rig", where=Argument("rig"), fix=fix)
        if checked_number(value, f"rig: {name}") <= 0.0 or weights[1:] == [name]:
            raise InputError(f"{value!r}", where=f"rig: {name}", fix=fix)
    replaced = STICK_WEIGHT if weights else ()
    return {name: value for name, value in attrs.items() if name not in replaced} | dict(sizes)


def _planned(recording: Recording, path: "str | PivotPath | None") -> Recording:
    """The recording with another path."""
    from ..hardware.motion import circle, star

    if path is None:
        return recording
    patterns = {"star": star, "circle": circle}
    if isinstance(path, str) and path in patterns:
        height = float(recording.gripper.position[0, 2])
        name, timed = path, patterns[path](speed=PATTERN_SPEED, height=height)
    elif not isinstance(path, str) and hasattr(path, "time") and hasattr(path, "position"):
        name, timed = "path", path
    else:
        raise InputError(
            f"{path!r:.80}",
            where=Argument("path"),
            fix="give star, circle, or what hardware.motion.star returns",
        )
    attrs = {key: value for key, value in recording.attrs.items() if key != "speed"}
    return replace(planned_recording(timed.time, timed.position, attrs), path=Path(name))


def _film(path: Path, pictures: Iterable[NDArray], count: int, progress: bool) -> None:
    """Write a movie of so many pictures."""
    with progress_bar("drawing", count, shown=progress) as advance:

        def counted() -> Iterator[NDArray]:
            for picture in pictures:
                yield picture
                advance(1)

        write_movie(path, counted())
