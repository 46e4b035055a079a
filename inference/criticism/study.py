"""An experiment, the model that should explain it, and runs of the model that are kept."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..arguments import checked_integer
from ..prior import Prior
from ..progress import Report
from ..simulations.bank import Simulation
from ..simulations.compute import Compute
from ..simulations.failures import NoSignals, unusable
from ..simulations.job import jobs, succeeded
from ..simulations.runner import run_missing
from .experiment import Experiment, Extensions, Proposal, extended
from .hypothesis import Hypothesis, hypothesise
from .misfit import Check, Signature, check, null_draws
from .runs import PriorBox, Runs

MIN_EFFECT_RUNS = 2


class AllRunsFailed(RuntimeError):
    """Every simulation of a phase failed; the message has the first one's error."""


def silent(phase: str, finished: int, total: int) -> None:
    """Reports nothing."""


@dataclass(frozen=True)
class Plan:
    """How many runs each step may make.

    Attributes:
        base: Of the base model, near where it fits best, in each of up to six passes, beside
            those there are already.
        start: Of the base model all over the prior, where there are none yet.
        extension: Of each effect, and of the base model with the same parameters and seeds.
        look: Of each of twice as many effects as are refitted, where they seem to fit best.
        refit: Near the best parameters of a near-best explanation, in each of up to four passes; up
            to eight where few are refitted.
        refits: Explanations that are refitted, and pairs of effects after them.
        held_out: Of each model for each held-out data set.
        most: Of looks and refits of single effects together, as many of pairs of them, and as many
            of the single effects of the best pair; those beyond are left out.
    """

    base: int = 8
    start: int = 16
    extension: int = 2
    look: int = 4
    refit: int = 8
    refits: int = 4
    held_out: int = 4
    most: int = 160

    def __post_init__(self) -> None:
        for name, count in vars(self).items():
            least = {"look": 0, "refits": 0, "most": 0, "extension": MIN_EFFECT_RUNS}
            checked_integer(name, count, least.get(name, 1))


@dataclass(frozen=True)
class Study:
    """Data, model and means that all steps share.

    Attributes:
        experiment: The data, and the simulator that should explain them.
        prior: Of the base parameters.
        extensions: All that may act.
        compute: Where runs are made and kept.
        plan: How many runs each step may make.
        seed: All seeds derive from it.
        report: Called with the phase, the number of simulations finished in it since the last
            call, and their number in all.
    """

    experiment: Experiment
    prior: Prior
    extensions: Extensions
    compute: Compute
    plan: Plan = field(default_factory=Plan)
    seed: int = 0
    report: Report = silent

    def run(self, phase: str, theta: Mapping[str, np.ndarray]) -> Runs:
        """Simulate at theta, name -> [n]; runs that fail are left out.

        Args:
            phase: A word for what they are for; with the run's number it fixes the seeds.

        Raises:
            AllRunsFailed: all of them did.
            RuntimeError: the executor lost its workers.
        """
        (made,) = self.run_each(phase, [theta])
        if not len(made):
            raise AllRunsFailed(made.error)
        return made

    def try_elsewhere(self, other: Experiment) -> None:
        """Simulate another experiment once, in the middle of the prior, before any run is wasted.

        Raises:
            AllRunsFailed: that failed, and so did three more runs.
        """
        middle = self.prior.from_unit(np.full((1, len(self.prior)), 0.5))
        for phase, count in ((f"try {other.label}", 1), (f"try {other.label} again", 3)):
            theta = {name: np.repeat(value, count) for name, value in middle.items()}
            (made,) = self.run_each(phase, [theta], other)
            if len(made):
                return
        raise AllRunsFailed(f"the held-out data {other.label!r} cannot be simulated: {made.error}")

    def run_each(
        self,
        phase: str,
        thetas: Sequence[Mapping[str, np.ndarray]],
        elsewhere: Experiment | Proposal | None = None,
    ) -> list[Runs]:
        """Simulate at several theta in one call; the k-th run of each has the same seed.

        So what they differ by is not chance. Where all runs at a theta fail, there are none of it.

        Args:
            elsewhere: Another experiment to simulate.

        Raises:
            RuntimeError: the executor lost its workers.
        """
        made_for = elsewhere or self.experiment
        counts = [len(next(iter(theta.values()))) for theta in thetas]
        seeds = phase_seeds(self.seed, phase, max(counts, default=0))
        asked = [jobs(theta, seeds[:n]) for theta, n in zip(thetas, counts, strict=True)]
        total = sum(counts)
        self.report(phase, 0, total)
        try:
            results = run_missing(
                made_for.simulate,
                sum(asked, []),
                self.compute,
                made_for.shape,
                identity=made_for.identity,
                advance=lambda finished: self.report(phase, finished, total),
            )
        except NoSignals as error:
            if len(thetas) > 1:  # those of others may return some
                return [self.run_each(phase, [theta], elsewhere)[0] for theta in thetas]
            results = [Simulation(None, unusable(str(error)), 0.0) for _ in asked[0]]
        runs = []
        for theta, batch in zip(thetas, asked, strict=True):
            own, results = results[: len(batch)], results[len(batch) :]
            good = succeeded(own)
            rows = np.array(list(good), int)
            errors = [
                f"at {job.theta}: {one.error or 'its output is not finite'}"
                for k, (job, one) in enumerate(zip(batch, own, strict=True))
                if k not in good
            ]
            error = ""
            if errors:
                failed = f"{len(errors)} of {len(batch)} simulations of the phase {phase!r} failed"
                error = f"{failed}, the first {errors[0]}"
            at = {name: np.asarray(column, float)[rows] for name, column in theta.items()}
            signals = np.reshape(list(good.values()), (len(rows), *made_for.shape))
            runs.append(self.table(at, signals, seeds[rows], error))
        return runs

    def table(
        self,
        theta: Mapping[str, np.ndarray],
        signals: np.ndarray,
        seeds: np.ndarray,
        error: str = "",
    ) -> Runs:
        """Simulations made elsewhere, coefficients that theta lacks being neutral."""
        neutral = {name: one.neutral for name, one in self.extensions.items()}
        whole = {name: np.full(len(seeds), value) for name, value in neutral.items()}
        whole |= {name: np.asarray(theta[name], float) for name in theta.keys()}
        return Runs(whole, neutral, signals, seeds, error)

    def hypothesis(self, names: tuple[str, ...], runs: Runs, within: PriorBox) -> Hypothesis:
        """The model in which the named effects act, fitted where it was simulated."""
        prior, data = extended(self.prior, self.extensions, names), self.experiment
        found = hypothesise(names, prior, runs, data.corrected, data.noise, within)
        own = data.at(found.best)
        if own.noise is data.noise:
            return found
        return hypothesise(names, prior, runs, own.corrected, own.noise, within)

    def points(self, box: PriorBox, names: tuple[str, ...], count: int) -> dict[str, np.ndarray]:
        """Parameters all over a box, name -> [count]."""
        return box.fill(extended(self.prior, self.extensions, names), self.seed, count)

    def check(
        self, hypothesis: Hypothesis, signatures: Mapping[str, Signature]
    ) -> tuple[Check, np.ndarray]:
        """Its test, and residuals [m, n] of a right model."""
        rng = np.random.default_rng(self.seed)
        null = null_draws(hypothesis, self.experiment.at(hypothesis.best).noise, rng)
        return check(hypothesis, signatures, null), null


def phase_seeds(seed: int, phase: str, count: int) -> np.ndarray:
    """Seeds in [0, 2^31), others for every phase."""
    words = np.random.SeedSequence([seed, *phase.encode()]).generate_state(count)
    return (words >> 1).astype(np.int64)
