"""Stirs and pours of liquids that a person describes: numbers, files and movies."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import Argument, InputError
from ..files import write_netcdf
from ..inputs.bundled import bundled_recording
from ..inputs.cups import cups_of
from ..inputs.described_liquid import COHESION, DENSITY, VISCOSITY, check_effects
from ..inputs.limits import number_of
from ..inputs.open import Source, open_recordings
from ..inputs.pour_table import check_distance, check_rate
from ..inputs.recording import LENGTHS, STICK_WEIGHT, Recording, Trajectory
from ..run.compute import open_compute
from ..simulators import RATE, BatchOf, PourSimulator, StirSimulator
from .batch import batch_of, simulated
from .files import check_targets, film_pour, film_stir, pour_dataset, stir_dataset

if TYPE_CHECKING:
    from xarray import Dataset

    from ..inference.simulations import Workers
    from ..models import Cups
    from ..models.trajectory import PivotPath

RIG_SIZES = (*LENGTHS, *STICK_WEIGHT)  # attributes of a recording that may be replaced
PATTERN_SPEED = 0.1  # m/s, of a star or circle that is given by its name


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

    targets, effects = check_targets(movie, out), check_effects(effects, "stir")
    weighed = None if density is None else number_of(density, Argument("density"))
    liquid = {"viscosity": viscosity, "cohesion": cohesion}
    # refused before a file is read
    batch_of(
        {**liquid, "density": DENSITY if weighed is None else weighed}, effects, particles, seed
    )
    (opened,) = open_recordings(bundled_recording("glycerin") if recording is None else recording)
    if targets.out is not None and targets.out.exists() and targets.out.samefile(opened.path):
        raise InputError(
            "is the recording itself", where=str(targets.out), fix="choose another name"
        )
    if weighed is None:
        weighed = opened.number("liquid_density")
    of_another = _with_rig(opened.attrs, rig) | {"liquid_density": weighed}
    plan = _planned(replace(opened, attrs=of_another), path)
    count = particles or StirSetup.from_recording(plan).particles
    batch = batch_of({**liquid, "density": weighed}, effects, count, seed)
    targets.check_single(batch.single)
    setup = StirSetup.from_recording(plan, particles=batch.one.particles)
    simulator = StirSimulator((plan,), (setup,))
    with open_compute(executor, timeout) as compute:
        angles = simulated(simulator, batch, compute)
    found = stir_dataset(batch, plan, angles)
    if targets.out is not None:
        write_netcdf(found, targets.out)
    if targets.movie is not None:
        film_stir(targets.movie, batch.one, simulator, progress)
    return found


def _with_rig(
    attrs: Mapping[str, float | str], rig: Mapping[str, float] | None
) -> dict[str, float | str]:
    """A recording's attributes with those of a rig in their place.

    Raises:
        InputError: They are no sizes by name, a name is none of `RIG_SIZES`, a value is no positive
            number, or the stick's mass and density are both given.
    """
    if rig is None:
        return dict(attrs)
    if not isinstance(rig, Mapping):
        raise InputError(f"{rig!r:.80}", where=Argument("rig"), fix="give sizes by name")
    for name, value in rig.items():
        if name not in RIG_SIZES:
            fix = f"give some of {', '.join(RIG_SIZES)}"
            raise InputError(f"{name!r} is no size of a rig", where="rig", fix=fix)
        if number_of(value, f"rig: {name}") <= 0.0:
            raise InputError(f"{value!r}", where=f"rig: {name}", fix="give a positive number")
    weighed = [name for name in STICK_WEIGHT if name in rig]
    if len(weighed) > 1:
        raise InputError(f"{' and '.join(weighed)} are given", where="rig", fix="give one of them")
    replaced = STICK_WEIGHT if weighed else ()
    return {name: value for name, value in attrs.items() if name not in replaced} | dict(rig)


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
    gripper = Trajectory(np.asarray(timed.time, np.float64), np.asarray(timed.position, np.float64))
    unseen = np.full((len(gripper.time), 2), np.nan)
    named = {key: value for key, value in recording.attrs.items() if key != "speed"}
    return replace(
        recording,
        time=gripper.time,
        gripper=gripper,
        inclination=unseen,
        attrs=named,
        path=Path(name),
    )


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
    from ..models import Landings, PourAction

    targets = check_targets(movie, out)
    cups, density = cups_of(cups), number_of(density, Argument("density"))
    check_distance(number_of(distance, Argument("distance")), cups, Argument("distance"))
    rate = Argument("angular_velocity")
    check_rate(number_of(angular_velocity, rate), cups, rate)
    liquid = {"viscosity": viscosity, "cohesion": cohesion, "density": density}
    batch = batch_of(liquid, check_effects(effects, "pour"), particles, seed)
    targets.check_single(batch.single)
    outcome, particles = LandedParticles(angular_velocity), batch.one.particles
    simulator = PourSimulator(cups, density, outcome, particles=particles)
    with open_compute(executor, timeout) as compute:
        signals = simulated(simulator, batch, compute)
    position = signals[:, 1:].reshape(len(signals), -1, 2).astype(np.float32)
    landings = Landings(position, signals[:, 0])
    action = PourAction(angular_velocity, distance)
    found = pour_dataset(batch, landings, action, cups)
    if targets.out is not None:
        write_netcdf(found, targets.out)
    if targets.movie is not None:
        film_pour(targets.movie, batch.one, simulator, action, progress)
    return found
