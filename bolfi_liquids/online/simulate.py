"""Simulating the plan, in a process that loads no JAX."""

from pathlib import Path
from typing import TYPE_CHECKING

from ..simulators import StirSimulator

if TYPE_CHECKING:
    from ..inference.simulations import Job, Simulation


def simulate_plan(stirring: StirSimulator, bank: Path, jobs: "list[Job]") -> "list[Simulation]":
    """Results of all jobs, in order; those that the bank lacks are simulated, and kept there."""
    from ..inference import SimulationBank
    from ..inference.simulations import Compute, run_missing

    with SimulationBank(bank) as kept:
        return run_missing(stirring.simulate, jobs, Compute(bank=kept), identity=stirring.identity)
