"""Runs of a simulator and of its extensions, kept in a bank."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..prior import Prior
from ..simulations.bank import Simulation
from ..simulations.compute import Compute
from ..simulations.failures import NoSignals
from ..simulations.job import jobs, succeeded
from ..simulations.runner import run_missing
from ..types import Simulator
from .experiment import Experiment, Proposal
from .model_extension import Extensions
from .run_table import Runs

Report = Callable[[str, int], object]
"""(phase, simulations finished in it since the last call)"""


class AllRunsFailed(RuntimeError):
    """Every simulation of a phase failed; the message has the first one's error."""


def silent(phase: str, finished: int) -> None:
    """Reports nothing."""


@dataclass(frozen=True)
class SimulatorRuns:
    """A simulator whose runs are kept.

    Attributes:
        simulate: (theta, seeds) -> signals; theta holds the base parameters, and of the
            coefficients those that act.
        prior: Of the base parameters.
        extensions: All that may act.
        compute: Where runs are made and kept.
        seed: All seeds derive from it.
        report: Called with the phase and the number of simulations finished in it.
        shape: Of one signal, that of what was observed; None takes the commonest of a phase.
        identity: The simulator's name in the bank.
    """

    simulate: Simulator
    prior: Prior
    extensions: Extensions
    compute: Compute
    seed: int = 0
    report: Report = silent
    shape: tuple[int, ...] | None = None
    identity: str = ""

    def of(self, experiment: Experiment | Proposal) -> "SimulatorRuns":
        """The same for the simulator of another experiment."""
        own = {"identity": experiment.identity, "shape": experiment.shape}
        return replace(self, simulate=experiment.simulate, **own)

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
                self.compute,
                self.shape,
                identity=self.identity,
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
