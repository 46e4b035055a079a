"""Stirs and pours of liquids that a person describes: numbers, files and movies."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..calibration.stir_simulator import Stirring
from ..errors import InputError
from ..files import write_netcdf
from ..inputs.bundled import bundled_recording
from ..inputs.cups import bundled_cups, open_cups
from ..inputs.described_liquid import check_effects
from ..inputs.open import Source, open_recordings
from ..inputs.prior import split_parameters
from ..inputs.recording import Recording, Trajectory
from ..run.time_limit import TimeLimited
from .batch import Where, batch_of, simulated
from .files import check_targets, pour_dataset, stir_dataset
from .film import film_pour, film_stir

if TYPE_CHECKING:
    from xarray import Dataset

    from ..inference.simulations import Workers
    from ..models import Cups

VISCOSITY, COHESION, DENSITY = 1.0, 0.2, 1260.0  # Pa s, 1, kg/m3: the bundled glycerin
DISTANCE_LIMITS = -0.5, 0.5  # m, between lip and receiver; more is a slip of the unit
PATTERN_SPEED = 0.1  # m/s, of a star or circle that is given by its name


class TimedPath(Protocol):
    """Times [s], shape (T,), and positions of the gripper [m], shape (T, 3)."""

    @property
    def time(self) -> NDArray[np.float64]: ...
    @property
    def position(self) -> NDArray[np.float64]: ...


def simulate_stir(  # noqa: PLR0913  the one call that most users make
    viscosity: ArrayLike = VISCOSITY,
    cohesion: ArrayLike = COHESION,
    *,
    density: float | None = None,
    effects: Mapping[str, float] | None = None,
    path: str | TimedPath | None = None,
    rig: Mapping[str, float] | None = None,
    recording: Source | None = None,
    particles: int = 1000,
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
        rig: Attributes of a recording, such as `cup_radius` [m], in place of the recording's.
        recording: Whose path and rig are used, or its file; None is a bundled stir of glycerin.
        particles: Number of particles of the simulated liquid.
        seed: Seed of the packing; an integer or shape (B,).
        executor: Where simulations run, see `calibrate`; the result has the same bits.
        timeout: Seconds that one simulation may take; None sets no limit.
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

    targets = check_targets(movie, out)
    (opened,) = open_recordings(bundled_recording("glycerin") if recording is None else recording)
    if targets.out is not None and targets.out.exists() and targets.out.samefile(opened.path):
        raise InputError(
            "is the recording itself", where=str(targets.out), fix="choose another name"
        )
    density = opened.number("liquid_density") if density is None else density
    liquid = {"viscosity": viscosity, "cohesion": cohesion, "density": density}
    batch = batch_of(liquid, check_effects(effects or {}, "stir"), particles, seed)
    targets.check_single(batch.single)
    plan = _planned(opened, path, {**(rig or {}), "liquid_density": float(density)})
    setup = StirSetup.from_recording(plan, particles=particles)
    angles = simulated(Stirring((plan,), (setup,)).simulate, batch, Where(executor, timeout))
    found = stir_dataset(batch, plan, angles)
    if targets.out is not None:
        write_netcdf(found, targets.out)
    if targets.movie is not None:
        film_stir(targets.movie, batch.one, plan, setup, progress)
    return found


def _planned(
    recording: Recording, path: str | TimedPath | None, attrs: Mapping[str, float]
) -> Recording:
    """The recording with another path and other attributes."""
    from ..hardware.motion import circle, star

    changed = replace(recording, attrs=MappingProxyType({**recording.attrs, **attrs}))
    if path is None:
        return changed
    patterns = {"star": star, "circle": circle}
    if not isinstance(path, str):
        name, timed = "path", path
    elif path in patterns:
        height = float(recording.gripper.position[0, 2])
        name, timed = path, patterns[path](speed=PATTERN_SPEED, height=height)
    else:
        raise InputError(
            f"{path!r}", where="path", fix="give star, circle, or what hardware.motion.star returns"
        )
    gripper = Trajectory(np.asarray(timed.time, np.float64), np.asarray(timed.position, np.float64))
    unseen = np.full((len(gripper.time), 2), np.nan)
    named = {key: value for key, value in changed.attrs.items() if key != "speed"}
    return replace(
        changed,
        time=gripper.time,
        gripper=gripper,
        inclination=unseen,
        attrs=MappingProxyType(named),
        path=Path(name),
    )


@dataclass(frozen=True)
class PourSimulator(TimeLimited):
    """One pour of liquids, as a simulator.

    Attributes:
        angular_velocity: Angular velocity of the source [rad/s].
        cups: Source and receiver.
        density: Density of the liquids [kg/m3].
        particles: Number of particles of each.
    """

    angular_velocity: float
    cups: "Cups"
    density: float
    particles: int

    def simulate(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """The retained fraction, then the landing of each particle [m]: (B, 1 + 2 particles)."""
        from .. import models

        liquid, effects = split_parameters(theta)
        landed = models.landings(
            models.Liquid(**liquid, density=self.density),
            self.angular_velocity,
            self.cups,
            seeds,
            self.particles,
            effects,
        )
        return np.column_stack([landed.retained, landed.position.reshape(len(seeds), -1)])


def simulate_pour(  # noqa: PLR0913  the one call that most users make
    viscosity: ArrayLike = VISCOSITY,
    cohesion: ArrayLike = COHESION,
    *,
    angular_velocity: float = np.radians(60.0),
    distance: float = 0.03,
    density: float = DENSITY,
    effects: Mapping[str, float] | None = None,
    cups: "Cups | str | Path | None" = None,
    particles: int = 664,
    seed: ArrayLike = 0,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    movie: str | Path | None = None,
    out: str | Path | None = None,
    progress: bool = True,
) -> "Dataset":
    """Simulate a pour from one cup into another.

    Args:
        viscosity, cohesion, effects, particles, seed: See `simulate_stir`.
        angular_velocity: Angular velocity of the source about its lip [rad/s].
        distance: Distance from the source's lip to the receiver's axis [m].
        density: Density of the liquid [kg/m3].
        cups: Source and receiver, or a TOML file of them; None are the bundled ones.
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
    _check_action(angular_velocity, distance)
    if cups is None or isinstance(cups, str | Path):
        cups = bundled_cups() if cups is None else open_cups(cups)
    liquid = {"viscosity": viscosity, "cohesion": cohesion, "density": density}
    batch = batch_of(liquid, check_effects(effects or {}, "pour"), particles, seed)
    targets.check_single(batch.single)
    simulator = PourSimulator(angular_velocity, cups, float(density), particles)
    signals = simulated(simulator.simulate, batch, Where(executor, timeout))
    position = signals[:, 1:].reshape(len(signals), particles, 2).astype(np.float32)
    landings = Landings(position, signals[:, 0])
    action = PourAction(angular_velocity, distance)
    found = pour_dataset(batch, landings, action, cups)
    if targets.out is not None:
        write_netcdf(found, targets.out)
    if targets.movie is not None:
        film_pour(targets.movie, batch.one, cups, action, landings, progress)
    return found


def _check_action(angular_velocity: float, distance: float) -> None:
    from ..models.pouring import FASTEST, SLOWEST

    low, high = DISTANCE_LIMITS
    if not low <= distance <= high:
        raise InputError(
            f"{100 * distance:g}", where="--distance", fix="give it in cm; in Python, in m"
        )
    if not SLOWEST <= angular_velocity <= FASTEST:
        slowest, fastest = np.degrees([SLOWEST, FASTEST])
        raise InputError(
            f"{np.degrees(angular_velocity):g}",
            where="--angular-velocity",
            fix=f"give {slowest:.2g} to {fastest:.4g} deg/s; in Python, in rad/s",
        )
