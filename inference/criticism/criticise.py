"""Find where a calibrated simulator and data disagree, and which effect explains it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ..arguments import (
    check_function,
    check_identity,
    check_kind,
    check_runs,
    checked_integer,
    checked_number,
)
from ..notebook_display import Displayed
from ..prior import Prior, checked_prior
from ..simulations.bank import SimulationBank
from ..simulations.compute import Workers, open_compute
from ..simulations.job import BATCH
from .design import Suggestion, rivals_of, suggest
from .experiment import Experiment, Extensions, Proposal, check_extensions
from .held_out import Gap, gap, holds, predictive_gains
from .hypothesis import Hypothesis, Interval, Weighted, weighted_posterior
from .misfit import Found, confusion, locate, null_draws
from .power import Sensitivity, sensitivity
from .search import Base, examine, explain, unsought
from .study import AllRunsFailed, Plan, Report, Study, silent
from .verdict import REJECTION_LEVEL, Candidate, Verdict, conclude, probabilities, remaining
from .verdict_kind import VerdictKind, advice


@dataclass(frozen=True, repr=False, eq=False)
class Criticism(Displayed):
    """Verdict on a model, its tests, and the explanations that were tried.

    Attributes:
        verdict: The conclusion.
        accepted: Effects that join the model: the verdict's one explanation, or what the caller
            accepted.
        base: The base model, its test, and every effect's signature.
        candidates: Every explanation that was fitted.
        extended: The model with the accepted effects; None without.
        posterior: Of the extended model, or else of the base model.
        before, after: Where the data disagree with the base and with the extended model.
        suggestions: Experiments that would separate explanations, best first.
        untested: Effects that were not refitted, or could not be simulated, here or for the
            held-out data, though they might explain the difference, and proposals that could not
            be simulated: name -> why.
        experiment: The data, their noise and the simulator.
        units: Of the effects' coefficients.
        tied: Names of each explanation that remains, best first.
        sensitivities: Sizes that the data would show, and sizes that they may hide, in the unit of
            the coefficient (`units`), for each effect that was simulated.
        probabilities: Of "none", of each explanation that was fitted, and of "none of these"; see
            `verdict`.
        simulations: Runs that were asked for, those found in the bank included.
    """

    verdict: Verdict
    accepted: tuple[str, ...]
    base: Base
    candidates: tuple[Candidate, ...]
    extended: Hypothesis | None
    posterior: Weighted
    before: tuple[Found, ...]
    after: tuple[Found, ...]
    suggestions: tuple[Suggestion, ...]
    untested: Mapping[str, str]
    experiment: Experiment
    units: Mapping[str, str]
    tied: tuple[tuple[str, ...], ...]
    probabilities: Mapping[str, float]
    sensitivities: Mapping[str, Sensitivity]
    simulations: int

    def _shown(self) -> list[tuple[str, str]]:
        units = {name: "" if unit == "1" else f" {unit}" for name, unit in self.units.items()}
        sizes = [
            (name, f"{one.mean:.3g} [{one.q05:.3g}, {one.q95:.3g}]{units[name]}")
            for name, one in self.coefficients.items()
        ]
        agrees = self.verdict.kind is VerdictKind.AGREEMENT
        limits = {name: one.limit for name, one in self.sensitivities.items() if agrees}
        hidden = ", ".join(f"{name} {size:.3g}{units[name]}" for name, size in limits.items())
        untested = [("not tested", f"{name} ({why})") for name, why in self.untested.items()]
        inert = ", ".join(self.base.inert)
        suggested = [("suggested experiment", str(one.label)) for one in self.suggestions[:1]]
        return [
            ("verdict", self.verdict.reason),
            ("next", self.advice),
            ("accepted", ", ".join(self.accepted) or "none"),
            *sizes,
            ("explanations tested", str(len(self.candidates)) if self.units else "no extensions"),
            *([("could hide", hidden)] if hidden else []),
            *untested,
            *([("changed no signal", f"{inert}; does the simulator read it?")] if inert else []),
            *suggested,
            ("simulations", str(self.simulations)),
        ]

    @property
    def advice(self) -> str:
        """What to do next."""
        if not self.units and self.verdict.kind is VerdictKind.AGREEMENT:
            return "Give extensions, to learn how large an effect these data could hide."
        leading = self.leading
        confirmed = leading is not None and bool(leading.gaps) and leading.accepted
        return advice(self.verdict.kind, confirmed=confirmed, suggested=bool(self.suggestions))

    @property
    def coefficients(self) -> dict[str, Interval]:
        """Mean and 90 % interval of each accepted effect's coefficient."""
        return {name: self.posterior.interval(name) for name in self.accepted}

    @property
    def singles(self) -> dict[str, Candidate]:
        """The explanations by one effect."""
        return {one.names[0]: one for one in self.candidates if len(one.names) == 1}

    @property
    def gaps(self) -> dict[tuple[str, ...], tuple[Gap, ...]]:
        """On held-out data, for each explanation that came so far: names -> gaps."""
        return {one.names: one.gaps for one in self.candidates if one.gaps}

    @property
    def refuted(self) -> tuple[tuple[str, ...], ...]:
        """Explanations of the fitted data that the held-out data do not bear out."""
        return tuple(one.names for one in self.candidates if one.passes and not one.held)

    def holds(self, names: tuple[str, ...]) -> bool:
        """Whether an explanation holds on the held-out data, see `gaps`; True without such data.

        Raises:
            KeyError: there are held-out data, and it was not compared with them.
        """
        return holds(self.gaps[names]) if self.gaps else True

    @property
    def leading(self) -> Candidate | None:
        """The accepted explanation, or the best of those that are tied."""
        tied = self.tied[0] if self.verdict.kind is VerdictKind.TIE else None
        return _among(self.candidates, self.accepted) or _among(self.candidates, tied)

    @property
    def isolability(self) -> np.ndarray:
        """Signal-to-noise ratio of each effect that no size of another effect absorbs [e, e].

        Rows are effects of their typical size, columns the others. Below about 3 the data do not
        distinguish the two.
        """
        side = np.array([of.side for of in self.base.signatures.values()])
        snr = np.array([of.snr for of in self.base.signatures.values()])
        # of two effects that act to one side each, one may lie where the other cannot
        opposite = np.multiply.outer(side, side) * self.confusion < 0.0
        cosine = np.where(opposite, 0.0, self.confusion)
        return snr[:, None] * np.sqrt(np.maximum(1.0 - cosine**2, 0.0))

    @property
    def confusion(self) -> np.ndarray:
        """Cosines between the effects' signatures [e, e]."""
        return confusion(self.base.hypothesis, self.base.signatures)


def criticise(  # noqa: PLR0913  the one call that most users make
    experiment: Experiment,
    prior: Prior,
    extensions: Extensions,
    *,
    earlier: tuple[Mapping[str, np.ndarray], np.ndarray, np.ndarray] | None = None,
    held_out: Sequence[Experiment] = (),
    proposals: Sequence[Proposal] = (),
    accept: Sequence[str] | None = None,
    level: float = REJECTION_LEVEL,
    plan: Plan | None = None,
    seed: int = 0,
    report: Report = silent,
    executor: Workers | None = None,
    bank: str | Path | SimulationBank = ":memory:",
    batch: int = BATCH,
    timeout: float | None = None,
) -> Criticism:
    """Test a simulator against data, and look for what it lacks.

    The base model is fitted and its residual tested (`misfit`). If its p-value is below `level`,
    every effect is fitted together with the base parameters. The best are simulated where they fit
    best and fitted again, and so are pairs that may be nearly as probable. What passes the test
    that the base model failed predicts the held-out data. All data together give each explanation,
    "none" and "none of these" a probability (`verdict`). The smallest set of explanations that
    holds the right one with a probability of 0.9 remains: what all of them have in common is an
    effect, else they are a tie. The most probable must have passed; on held-out data it must leave
    no more than noise, explain most of the gap and predict better than the base model.

    All runs are kept in the bank under seeds that derive from one: the same call repeats
    nothing that was finished and concludes the same.

    Args:
        experiment: What was observed, and the simulator.
        prior: Of the base parameters.
        extensions: What the simulator may lack, by name; without any, it is only tested.
        earlier: Runs of the base model made before: theta, signals, seeds.
        held_out: Experiments that nothing is fitted to.
        proposals: Experiments that could be made next.
        accept: Effects to accept, whatever the verdict; None accepts what the verdict names.
        level: p-value of the base model below which explanations are looked for.
        plan: How many runs each step may make.
        seed: Fixes everything random.
        report: Called with the phase, the number of simulations finished in it since the last
            call, and their number in all.
        executor, bank, timeout: See `fit`.
        batch: Simulations in one call of the simulator, where there is no executor.

    Raises:
        ValueError: an argument makes no sense, a held-out experiment is the fitted one, or the
            bank would confuse two experiments.
        RuntimeError: every simulation of a phase failed, or the executor lost its workers. An
            effect that could not be simulated at all is in `Criticism.untested` instead.
        ImportError, ConnectionError: Dask is not installed, or does not answer.

    Example:
        A parabola criticised as a straight line:

        >>> import numpy as np
        >>> import numpyro.distributions as dist
        >>> from bolfi_liquids.inference import Prior, criticism
        >>> time = np.linspace(0, 1, 40)
        >>> def simulate(theta, seeds):
        ...     bend = theta.get("bend", np.zeros(len(seeds)))
        ...     return theta["slope"][:, None] * time + bend[:, None] * time**2
        >>> observed = time + time**2 + np.random.default_rng(1).normal(0, 0.05, 40)
        >>> data = criticism.Experiment(simulate, observed, criticism.KnownNoise(0.05))
        >>> bend = criticism.Extension(dist.Normal(0, 1))
        >>> found = criticism.criticise(data, Prior({"slope": dist.Uniform(-3, 3)}), {"bend": bend})
        >>> found.accepted
        ('bend',)
    """
    checked_prior(prior)
    check_extensions(prior, extensions)
    check_kind("experiment", experiment, Experiment)
    _check_others("held_out", held_out, Experiment)
    _check_others("proposals", proposals, Proposal)
    for one in (experiment, *held_out):
        one.check_noise()
    for one in held_out:
        if np.array_equal(one.observed, experiment.observed, equal_nan=True):
            raise ValueError(
                f"the held-out experiment {one.label!r} holds the very data that are fitted; "
                "nothing can be proved on them: give data of another run"
            )
    check_kind("accept", accept, list | tuple | None)
    if unknown := [name for name in accept or () if name not in tuple(extensions)]:
        raise ValueError(
            f"cannot accept {', '.join(map(repr, unknown))}; there are {', '.join(extensions)}"
        )
    checked_number("level", level, lambda p: 0.0 < p < 1.0, "a number between 0 and 1")
    check_kind("plan", plan, Plan | None)
    checked_integer("seed", seed, 0)
    check_function("report", report)
    check_runs("earlier", earlier, 3)
    count = 0

    def counted(phase: str, finished: int, total: int) -> None:
        nonlocal count
        count += finished
        report(phase, finished, total)

    for one in (experiment, *held_out, *proposals):
        check_identity(one.identity, "bank", getattr(bank, "path", bank))
    with open_compute(executor, timeout, batch, bank) as compute:
        study = Study(experiment, prior, extensions, compute, plan or Plan(), seed, counted)
        for one in held_out:
            study.try_elsewhere(one)
        base = examine(study, None if earlier is None else study.table(*earlier))
        sought, asked = [], None
        if accept is not None or base.check.p_value < level:
            sought, asked = _explanations(study, base, accept, held_out)
        fitted = sought if base.check.p_value < level else unsought(base)
        probability = probabilities(base.check, fitted, len(extensions))
        verdict = conclude(base.check, sought, probability, level)
        members = remaining(probability, sought)
        rivals = _rivals(verdict, sought, members)
        known = rivals_of(rivals, probability, seed) if proposals else {}
        suggestions, not_made = suggest(study, proposals, known)
    named = verdict.effects if verdict.kind is VerdictKind.EFFECT else ()
    accepted = tuple(accept) if accept is not None else named
    leading = asked or _among(sought, accepted)
    candidates = [one for one in sought if asked is None or one.names != asked.names]
    candidates += [asked] if asked else []
    extended = leading.hypothesis if leading else None
    concluded = experiment.at((extended or base.hypothesis).best)
    left = []
    if extended is not None:
        null = null_draws(extended, concluded.noise, np.random.default_rng(seed))
        left = locate(extended, experiment.windows, null)
    return Criticism(
        verdict=verdict,
        accepted=accepted,
        base=base,
        candidates=tuple(candidates),
        extended=extended,
        posterior=weighted_posterior(extended or base.hypothesis, seed),
        before=tuple(locate(base.hypothesis, experiment.windows, base.null)),
        after=tuple(left),
        suggestions=tuple(suggestions),
        untested=base.untested | _left_out(candidates) | not_made,
        experiment=concluded,
        units={name: one.unit for name, one in extensions.items()},
        tied=tuple(one.names for one in members if verdict.kind is not VerdictKind.AGREEMENT),
        probabilities=probability,
        sensitivities={
            name: sensitivity(base.hypothesis, single, extensions[name], len(extensions))
            for name, single in base.singles.items()
        },
        simulations=count,
    )


def _explanations(
    study: Study, base: Base, accept: Sequence[str] | None, held_out: Sequence[Experiment]
) -> tuple[list[Candidate], Candidate | None]:
    """Fit explanations, and test those that passed on the held-out data.

    Returns:
        All of them; and, if there are effects to accept, the explanation by these, which is
        refitted and tested besides and changes none of the others.
    """
    sought, asked = explain(study, base, accept)
    chosen = [one for one in sought if one.accepted]
    judged = _judged(study, base, chosen, held_out)
    after = {one.names: one for one in judged}
    if asked is not None:
        (asked,) = _judged(study, base, [asked], held_out)
    return [after.get(one.names, one) for one in sought], asked


def _rivals(
    verdict: Verdict, candidates: Sequence[Candidate], members: Sequence[Candidate]
) -> list[Candidate]:
    """Explanations that a further experiment should tell apart."""
    if len(members) > 1:
        return list(members)
    if verdict.kind is VerdictKind.UNKNOWN:
        return sorted(candidates, key=lambda c: -c.gain)[:2]
    return []


def _left_out(candidates: Sequence[Candidate]) -> dict[str, str]:
    """Effects that alone would pass the test but were not refitted, and those of explanations that
    could not be simulated for held-out data: name -> why."""
    found: dict[str, str] = {}
    for one in candidates:
        if one.unpredicted:
            found |= dict.fromkeys(one.names, one.unpredicted)
        elif len(one.names) == 1 and one.passes and not one.refitted:
            found |= dict.fromkeys(one.names, "it was not refitted")
    return found


def _among(candidates: Sequence[Candidate], names: Sequence[str] | None) -> Candidate | None:
    """The explanation by just these effects, in whatever order."""
    return next((c for c in candidates if names and set(c.names) == set(names)), None)


def _judged(
    study: Study, base: Base, chosen: Sequence[Candidate], held_out: Sequence[Experiment]
) -> list[Candidate]:
    """Explanations with their gaps on the held-out data, or why these could not be simulated."""
    if not chosen or not held_out:
        return list(chosen)
    count, seed = study.plan.held_out, study.seed
    models = [base.hypothesis, *(one.hypothesis for one in chosen)]
    drawn = [weighted_posterior(model, seed).draw(seed, count) for model in models]
    found = list(chosen)
    for one in held_out:
        before, *after = study.run_each(f"held out {one.label}", drawn, one)
        if not len(before):
            raise AllRunsFailed(before.error)
        there = np.isfinite(one.observed)
        neutral, made = before.signals[:, there], [runs.signals[:, there] for runs in after]
        acting = [k for k, runs in enumerate(after) if len(runs)]
        own = [one.at(model.best) for model in models]
        evidence = predictive_gains(
            [own[0], *(own[k + 1] for k in acting)], [neutral, *(made[k] for k in acting)]
        )
        for k, gained in zip(acting, evidence, strict=True):
            new = gap(own[k + 1], neutral, made[k], seed)._replace(evidence=float(gained))
            found[k] = replace(found[k], gaps=(*found[k].gaps, new))
        for k in set(range(len(found))) - set(acting):
            # what cannot be simulated there is not borne out there
            found[k] = replace(found[k], unpredicted=found[k].unpredicted or after[k].error)
    return [replace(one, gaps=()) if one.unpredicted else one for one in found]


def _check_others(name: str, given: Any, kind: type) -> None:
    """Raise ValueError unless these are experiments or proposals that the bank tells apart."""
    check_kind(name, given, list | tuple)
    for one in given:
        check_kind(f"each of {name}", one, kind)
    for one, other in combinations(given, 2):
        told_apart = one.identity or other.identity or one.label != other.label
        if not told_apart and one.simulate != other.simulate:
            raise ValueError(
                f"two experiments {one.label!r} of different simulators have no identity, so the "
                "bank would take the runs of one for the other's: give each its own identity or "
                "label"
            )
