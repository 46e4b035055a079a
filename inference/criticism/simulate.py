"""Runs of a simulator and of its extensions, kept in a bank."""

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..prior import Prior
from ..simulations.bank import SimulationBank
from ..simulations.job import BATCH, jobs, succeeded
from ..simulations.runner import Keep, run_missing
from ..types import Simulator
from .experiment import Experiment, Proposal
from .extension import Extensions
from .run_table import Runs

Report = Callable[[str, int], None]
"""(phase, simulations finished in it since the last call)"""


def silent(phase: str, finished: int) -> None:
    """Reports nothing."""


@dataclass(frozen=True)
class Keeping:
    """Where simulations are kept, and how they are made.

    Attributes:
        bank: Takes every finished one; what it holds is not simulated again.
        batch: Simulated in one call.
        seed: All of their seeds derive from it.
        report: Told of every simulation.
        executor: Simulates each run in a call of its own; None simulates in this process.
        timeout: Seconds that one run may take; None sets no limit.
    """

    bank: SimulationBank = field(default_factory=SimulationBank)
    batch: int = BATCH
    seed: int = 0
    report: Report = silent
    executor: Executor | None = None
    timeout: float | None = None

    def of(self, identity: str) -> Keep:
        """The same for one simulator, by its name in the bank."""
        return Keep(self.bank, identity, self.batch, self.executor, self.timeout)


@dataclass(frozen=True)
class Laboratory:
    """A simulator whose runs are kept.

    Attributes:
        simulate: (theta, seeds) -> signals; theta holds the base parameters, and of the
            coefficients those that act.
        prior: Of the base parameters.
        extensions: All that may act.
        identity: The simulator's name in the bank.
        keeping: Where runs are kept.
    """

    simulate: Simulator
    prior: Prior
    extensions: Extensions
    identity: str
    keeping: Keeping

    def of(self, experiment: Experiment | Proposal) -> "Laboratory":
        """The same for the simulator of another experiment."""
        return replace(self, simulate=experiment.simulate, identity=experiment.identity)

    def run(self, phase: str, theta: Mapping[str, np.ndarray]) -> Runs:
        """Simulate at theta, name -> [n]; runs that fail are left out.

        Args:
            phase: A word for what they are for; with the run's number it fixes the seeds.

        Raises:
            RuntimeError: all of them failed.
        """
        seeds = phase_seeds(self.keeping.seed, phase, len(next(iter(theta.values()))))
        asked = jobs(theta, seeds)
        keeping = self.keeping
        report = partial(keeping.report, phase)
        results = run_missing(self.simulate, asked, keeping.of(self.identity), advance=report)
        good = succeeded(results)
        if not good:
            raise RuntimeError(
                f"all {len(asked)} simulations of the phase {phase!r} failed, the first at "
                f"{asked[0].theta}: {results[0].error or 'its output is not finite'}"
            )
        rows = list(good)
        kept = {name: np.asarray(column, float)[rows] for name, column in theta.items()}
        return self.table(kept, np.stack(list(good.values())), seeds[rows])

    def table(
        self, theta: Mapping[str, np.ndarray], signals: np.ndarray, seeds: np.ndarray
    ) -> Runs:
        """Simulations made elsewhere, coefficients that theta lacks being neutral."""
        count, effects = len(seeds), tuple(self.extensions)
        neutral = {name: np.full(count, self.extensions[name].neutral) for name in effects}
        whole = {**neutral, **theta}
        acting = np.stack([whole[name] != neutral[name] for name in effects], axis=1)
        return Runs(whole, acting, signals, seeds, effects)


def phase_seeds(seed: int, phase: str, count: int) -> np.ndarray:
    """Seeds in [0, 2^31), others for every phase."""
    words = np.random.SeedSequence([seed, *phase.encode()]).generate_state(count)
    return (words >> 1).astype(np.int64)
