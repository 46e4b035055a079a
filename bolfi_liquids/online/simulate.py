"""Simulating the plan, in a process that loads no JAX."""

from pathlib import Path
from typing import TYPE_CHECKING

from ..simulators import StirSimulator

if TYPE_CHECKING:
    from ..inference.simulations import Job, Simulation


def simulate_plan(
    stirring: StirSimulator, bank: Path, batch: int, jobs: "list[Job]"
) -> "list[Simulation]":
    """Simulate what a bank lacks, and keep it there.

    Args:
        stirring: Of the plan.
        bank: File of the simulation bank.
        batch: Simulations that are made together.
        jobs: What is wanted.

    Returns:
        Results of all jobs, in order.
    """
    from ..inference import SimulationBank
    from ..inference.simulations import Compute, run_missing

    with SimulationBank(bank) as kept:
        compute = Compute(bank=kept, batch=batch)
        return run_missing(stirring.batched, jobs, compute, identity=stirring.identity)
