"""Liquids that are simulated in one call, by numbers or by arrays of them."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..inputs.described_liquid import Described
from ..progress import Simulate
from .film import failures_raised

if TYPE_CHECKING:
    from ..inference.simulations import Workers


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

    @property
    def leading(self) -> tuple[str, ...]:
        """Dimensions of the results before those of one simulation."""
        return () if self.single else ("simulation",)

    def shaped(self, values: NDArray) -> NDArray:
        """Values of all simulations, without that axis where there is one simulation."""
        return values[0] if self.single else values


class Where(NamedTuple):
    """Where simulations run: see `calibrate`."""

    executor: "Workers | None" = None
    timeout: float | None = None


def batch_of(
    liquid: Mapping[str, ArrayLike],
    effects: Mapping[str, float] | None,
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
    values = {**liquid, "seed": seed}
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
            effects=dict(effects or {}),
            particles=particles,
            seed=columns["seed"].flat[at].item(),
        )
        for at in range(columns["seed"].size)
    )
    if not liquids:
        raise InputError("no simulation", where="simulate", fix="give at least one value")
    return Batch(liquids, columns["seed"].ndim == 0)


def simulated(simulate: Simulate, batch: Batch, where: Where) -> NDArray[np.float64]:
    """Signals of all liquids, shape (simulations, ...).

    Args:
        simulate: As given to `inference.fit`.
        batch: The liquids; their density is the simulator's.
        where: Where simulations run.

    Raises:
        RuntimeError: A simulation failed.
    """
    from ..inference import Job, SimulationBank
    from ..inference.simulations import Keep, open_executor, run_missing

    jobs = [
        Job({"viscosity": one.viscosity, "cohesion": one.cohesion, **one.effects}, one.seed)
        for one in batch.liquids
    ]
    with failures_raised(), SimulationBank() as bank, open_executor(where.executor) as workers:
        made = run_missing(simulate, jobs, Keep(bank, "", None, workers, where.timeout))
    for job, one in zip(jobs, made, strict=True):
        if one.error is not None:
            raise RuntimeError(f"the simulation of {job.theta} failed: {one.error}")
    return np.stack([one.signal for one in made if one.signal is not None])
