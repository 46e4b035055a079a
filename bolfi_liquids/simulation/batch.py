"""Liquids that are simulated in one call, by numbers or by arrays of them."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import Argument, InputError
from ..inference.arguments import checked_array
from ..inputs.described_liquid import Described
from ..simulators import FluidSimulator

if TYPE_CHECKING:
    from ..inference.simulations import Compute


class Batch(NamedTuple):
    """Described liquids, one for each simulation.

    Attributes:
        liquids: At least one.
        single: Whether only scalars were given, so that results have no axis for simulations.
    """

    liquids: tuple[Described, ...]
    single: bool

    @property
    def one(self) -> Described:
        """The liquid, where it is the only one."""
        return self.liquids[0]


def batch_of(
    liquid: Mapping[str, ArrayLike],
    effects: Mapping[str, float],
    particles: int,
    seed: ArrayLike,
) -> Batch:
    """Liquids of which each value is a number, or an array of one for each simulation.

    Args:
        liquid: `viscosity`, `cohesion` and `density`.
        effects: Coefficients by name, the same for all.
        particles: Number of particles of each.
        seed: Seed of each packing.

    Raises:
        InputError: A value cannot be used, or arrays differ in length.
    """
    values = {name: _numbers(name, value) for name, value in liquid.items()}
    values["seed"] = np.asarray(seed, dtype=object)  # `Described` looks at each
    try:
        columns = dict(zip(values, np.broadcast_arrays(*values.values()), strict=True))
    except ValueError as err:
        shapes = {name: np.shape(value) for name, value in values.items()}
        raise InputError(
            f"shapes {shapes}", where="simulate", fix="give numbers, or arrays of one length"
        ) from err
    if columns["seed"].ndim > 1:
        raise InputError(
            f"arrays of {columns['seed'].ndim} dimensions",
            where="simulate",
            fix="give numbers, or arrays of one dimension",
        )
    liquids = tuple(
        Described(
            **{name: float(columns[name].flat[at]) for name in liquid},
            effects=effects,
            particles=particles,
            seed=columns["seed"].flat[at],
        )
        for at in range(columns["seed"].size)
    )
    if not liquids:
        raise InputError("no simulation", where="simulate", fix="give at least one value")
    return Batch(liquids, columns["seed"].ndim == 0)


def _numbers(name: str, value: ArrayLike) -> NDArray:
    """`value` as an array.

    Raises:
        InputError: It is complex, text, or of no one shape.
    """
    try:
        return checked_array(name, value)
    except ValueError as err:
        raise InputError(
            f"{value!r:.80}", where=Argument(name), fix="give a number, or an array of them"
        ) from err


@dataclass(frozen=True)
class Raising(FluidSimulator):
    """A simulator that raises, in whatever process, where a simulation goes wrong.

    Attributes:
        simulator: Warns and returns NaN there.
    """

    simulator: FluidSimulator

    @property
    def identity(self) -> str:
        """The simulator's."""
        return self.simulator.identity

    def simulate(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """What the simulator returns.

        Raises:
            RuntimeError: A simulation went wrong.
        """
        from ..models import FailedSimulation

        with warnings.catch_warnings():
            warnings.simplefilter("error", FailedSimulation)
            try:
                return self.simulator.simulate(theta, seeds)
            except FailedSimulation as err:
                raise RuntimeError(str(err)) from None


def theta_of(described: Described) -> dict[str, float]:
    """Parameters of a described liquid, and the coefficients of its effects."""
    liquid = {"viscosity": described.viscosity, "cohesion": described.cohesion}
    return liquid | dict(described.effects)


def simulated(simulator: FluidSimulator, batch: Batch, compute: "Compute") -> NDArray[np.float64]:
    """Signals of all liquids, shape (simulations, ...).

    Args:
        simulator: Of stirs or pours; the first number of a signal is finite unless it failed.
        batch: The liquids; their density is the simulator's.
        compute: Where simulations run.

    Raises:
        RuntimeError: A simulation failed.
    """
    from ..inference.simulations import Job, run_missing

    jobs = [Job(theta_of(one), one.seed) for one in batch.liquids]
    made, signals = run_missing(Raising(simulator).batched, jobs, compute), []
    for job, one in zip(jobs, made, strict=True):
        if one.signal is None:
            raise RuntimeError(f"the simulation of {job.theta} failed: {one.error}")
        if not np.isfinite(one.signal.flat[0]):
            raise RuntimeError(f"the simulation of {job.theta} failed: its result is not finite")
        signals.append(one.signal)
    return np.stack(signals)
