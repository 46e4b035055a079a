"""Runs of a simulator and of its extensions, kept in a bank."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..arguments import check_function, check_kind, checked_integer
from ..prior import Prior
from ..simulations.bank import Simulation, SimulationBank
from ..simulations.executors import Workers, check_executor, open_executor
from ..simulations.failures import NoSignals
from ..simulations.job import BATCH, jobs, succeeded
from ..simulations.runner import Keep, check_keep, run_missing
from ..types import Simulator
from .experiment import Experiment, Proposal
from .model_extension import Extensions
from .run_table import Runs

Report = Callable[[str, int], None]
"""(phase, simulations finished in it since the last call)"""


class AllRunsFailed(RuntimeError):
    """Every simulation of a phase failed; the message has the first one's error."""


def silent(phase: str, finished: int) -> None:
    """Reports nothing."""


@dataclass(frozen=True)
class Keeping:
    """Where simulations are kept, and how they are made.

    Attributes:
        bank: Takes every finished simulation; what it holds is not simulated again. None keeps
            them until the call ends.
        batch: Simulations in one call of the simulator, where there is no executor.
        seed: All of their seeds derive from it.
        report: Called with the phase and the number of simulations finished in it.
        executor: Makes the simulations, see `fit`; what is given open stays open. None simulates
            in this process.
        timeout: Seconds that one simulation may take, see `fit`; None sets no limit.

    Raises:
        ValueError: a batch, seed, report or timeout that cannot be used.
    """

    bank: SimulationBank | None = None
    batch: int = BATCH
    seed: int = 0
    report: Report = silent
    executor: Workers | None = None
    timeout: float | None = None

    def __post_init__(self) -> None:
        check_keep(checked_integer("batch", self.batch), self.timeout)
        checked_integer("seed", self.seed, 0)
        check_function("report", self.report)
        if self.bank is not None:
            check_kind("bank", self.bank, SimulationBank)
        check_executor(self.executor)

    @contextmanager
    def opened(self, identity: str) -> Iterator[Keep]:
        """Bank and executor for the simulator of this name; what is opened here is closed.

        Raises:
            ValueError, ImportError, ConnectionError: the executor cannot be used.
        """
        with ExitStack() as stack:
            workers = stack.enter_context(open_executor(self.executor))
            bank = stack.enter_context(SimulationBank()) if self.bank is None else self.bank
            yield Keep(bank, identity, self.batch, workers, self.timeout)


@dataclass(frozen=True)
class SimulatorRuns:
    """A simulator whose runs are kept.

    Attributes:
        simulate: (theta, seeds) -> signals; theta holds the base parameters, and of the
            coefficients those that act.
        prior: Of the base parameters.
        extensions: All that may act.
        keep: Where runs are made and kept.
        shape: Of one signal, that of what was observed; None takes the commonest of a phase.
        seed: All seeds derive from it.
        report: Called with the phase and the number of simulations finished in it.
    """

    simulate: Simulator
    prior: Prior
    extensions: Extensions
    keep: Keep
    seed: int = 0
    report: Report = silent
    shape: tuple[int, ...] | None = None

    def of(self, experiment: Experiment | Proposal) -> "SimulatorRuns":
        """The same for the simulator of another experiment."""
        keep = self.keep._replace(identity=experiment.identity)
        shape = experiment.shape
        return replace(self, simulate=experiment.simulate, keep=keep, shape=shape)

    def run(self, phase: str, theta: Mapping[str, np.ndarray]) -> Runs:
        """Simulate at theta, name -> [n]; runs that fail are left out.

        Args:
            phase: A word for what they are for; with the run's number it fixes the seeds.

        Raises:
            AllRunsFailed: all of them did.
            RuntimeError: the executor lost its workers.
        """
        (made,) = self.run_each(phase, [theta])
        if isinstance(made, AllRunsFailed):
            raise made
        return made

    def run_each(
        self, phase: str, thetas: Sequence[Mapping[str, np.ndarray]]
    ) -> "list[Runs | AllRunsFailed]":
        """The same at several theta in one call; the k-th run of each has the same seed.

        So what they differ by is not chance.

        Raises:
            RuntimeError: the executor lost its workers.
        """
        counts = [len(next(iter(theta.values()))) for theta in thetas]
        seeds = phase_seeds(self.seed, phase, max(counts, default=0))
        asked = [jobs(theta, seeds[:n]) for theta, n in zip(thetas, counts, strict=True)]
        try:
            results = run_missing(
                self.simulate,
                sum(asked, []),
                self.keep,
                self.shape,
                advance=partial(self.report, phase),
            )
        except NoSignals as error:
            if len(thetas) > 1:  # those of others may return some
                return [self.run_each(phase, [theta])[0] for theta in thetas]
            told = f"no simulation of the phase {phase!r} returned a signal: {error}"
            return [AllRunsFailed(told)]
        ends = np.cumsum(counts)
        return [
            self._succeeded(phase, theta, seeds[:n], results[end - n : end])
            for theta, n, end in zip(thetas, counts, ends, strict=True)
        ]

    def _succeeded(
        self,
        phase: str,
        theta: Mapping[str, np.ndarray],
        seeds: np.ndarray,
        results: Sequence[Simulation],
    ) -> "Runs | AllRunsFailed":
        good = succeeded(results)
        if not good:
            first = {name: float(column[0]) for name, column in theta.items()}
            return AllRunsFailed(
                f"all {len(results)} simulations of the phase {phase!r} failed, the first at "
                f"{first}: {results[0].error or 'its output is not finite'}"
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
        whole = {**neutral, **{name: np.asarray(theta[name], float) for name in theta.keys()}}
        acting = np.stack([whole[name] != neutral[name] for name in effects], axis=1)
        return Runs(whole, acting, signals, seeds, effects)


def phase_seeds(seed: int, phase: str, count: int) -> np.ndarray:
    """Seeds in [0, 2^31), others for every phase."""
    words = np.random.SeedSequence([seed, *phase.encode()]).generate_state(count)
    return (words >> 1).astype(np.int64)
