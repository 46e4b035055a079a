"""The search for the effect that a model lacks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..arguments import checked_integer
from ..bolfi import MIN_LEARN
from .clean_scores import scored_on_clean
from .hypothesis import Hypothesis, hypothesise
from .measurement_noise import Noise
from .misfit import Check, check, null_draws
from .model_extension import extended
from .prior_boxes import (
    FIRST_HALF_WIDTH,
    LATER_HALF_WIDTH,
    Box,
    around,
    everywhere,
    fill,
    hull,
    with_coefficient,
    with_whole_priors,
)
from .run_table import Runs, joined
from .signatures import Signature, signature
from .simulate import AllRunsFailed, Laboratory
from .verdict import Candidate, near_best

REFIT_PASSES = 2  # of a refit, the second only if the best fit is not well inside the first's box
SECOND_EFFECT_GAIN = 6.0  # log likelihood that a second effect must gain


@dataclass(frozen=True)
class Plan:
    """How many runs each step may make.

    Attributes:
        base: Of the base model, near where it fits best, beside those there are already.
        start: Of the base model all over the prior, where there are none yet.
        extension: Of each effect.
        refit: Near the best parameters of a near-best explanation.
        refits: Explanations that are refitted, and pairs of effects after them.
        held_out: Of each model for each held-out data set.
        most: Of all these but the held-out ones; refits beyond are left out.
    """

    base: int = 24
    start: int = 16
    extension: int = 10
    refit: int = 16
    refits: int = 3
    held_out: int = 8
    most: int = 400

    def __post_init__(self) -> None:
        for name, count in vars(self).items():
            checked_integer(name, count, 0 if name in ("refits", "most") else 1)


class Study(NamedTuple):
    """Data, and the simulator that should explain them."""

    laboratory: Laboratory
    observed: np.ndarray
    noise: Noise
    plan: Plan

    @property
    def seed(self) -> int:
        return self.laboratory.seed

    def hypothesis(self, names: tuple[str, ...], runs: Runs, within: Box) -> Hypothesis:
        """The model in which the named effects act, fitted where it was simulated."""
        prior = extended(self.laboratory.prior, self.laboratory.extensions, names)
        return hypothesise(names, prior, runs, self.observed, self.noise, within)

    def run(self, phase: str, box: Box, names: tuple[str, ...], count: int) -> Runs:
        """Runs all over a box."""
        prior = extended(self.laboratory.prior, self.laboratory.extensions, names)
        return self.laboratory.run(phase, fill(box, prior, self.seed, count))

    def check(
        self, hypothesis: Hypothesis, signatures: Mapping[str, Signature]
    ) -> tuple[Check, np.ndarray]:
        """Its test, and residuals [m, n] of a right model."""
        null = null_draws(hypothesis, self.noise, np.random.default_rng(self.seed))
        return check(hypothesis, signatures, null), null

    def candidate(self, base: "Base", hypothesis: Hypothesis, refitted: bool = False) -> Candidate:
        """The extended model, tested."""
        metric = base.hypothesis
        gain = 0.5 * (metric.misfit(metric) - hypothesis.misfit(metric))
        return Candidate(hypothesis, self.check(hypothesis, base.signatures)[0], gain, refitted)


class Base(NamedTuple):
    """The base model and what the effects would do to it."""

    hypothesis: Hypothesis
    check: Check
    null: np.ndarray  # [m, n], residuals of a right model
    signatures: dict[str, Signature]
    singles: dict[str, Hypothesis]
    box: Box  # in which effects were simulated
    runs: Runs
    given: int  # of the runs, made before


def fit_base(study: Study, earlier: Runs | None) -> tuple[Hypothesis, Runs, Box]:
    """Fit the base model near its optimum. Return the fit, its runs and their box."""
    whole = everywhere(len(study.laboratory.prior))
    runs = study.run("start", whole, (), study.plan.start) if earlier is None else earlier
    first = study.hypothesis((), runs, whole)
    box = around(first.u, first.sd, FIRST_HALF_WIDTH)
    runs = joined([runs, study.run("base", box, (), study.plan.base)])
    return study.hypothesis((), runs, whole), runs, box


def examine(study: Study, earlier: Runs | None) -> tuple[Base, tuple[str, ...]]:
    """Fit the base model, learn every effect's signature, and test the model.

    Returns:
        What was found, and the effects of which too few simulations succeeded to learn from.
    """
    laboratory, plan = study.laboratory, study.plan
    base, runs, box = fit_base(study, earlier)
    parts = [runs]
    singles, untested = {}, []
    for name in laboratory.extensions:
        wide = with_coefficient(box)
        try:
            made = study.run(f"effect {name}", wide, (name,), plan.extension)
        except AllRunsFailed:
            made = runs.rows(np.zeros(len(runs), bool))
        if len(made) < MIN_LEARN:
            untested.append(name)
            continue
        parts.append(made)
        within = with_whole_priors(box, 1)
        singles[name] = study.hypothesis((name,), joined([runs, made]), within)
    signatures = {
        name: signature(base, single, laboratory.extensions[name])
        for name, single in singles.items()
    }
    signatures = scored_on_clean(base, study.noise, signatures)
    tested, null = study.check(base, signatures)
    given = 0 if earlier is None else len(earlier)
    found = Base(base, tested, null, signatures, singles, box, joined(parts), given)
    return found, tuple(untested)


def explain(
    study: Study, base: Base, accept: Sequence[str] | None = None
) -> tuple[list[Candidate], list[Candidate]]:
    """Fit every explanation by one effect, and pairs of effects where no single one suffices.

    Args:
        accept: Effects that are refitted together, whatever their rank.

    Returns:
        All explanations, and the accepted ones.

    Raises:
        AllRunsFailed: an effect to be accepted cannot be simulated.
    """
    plan, runs = study.plan, base.runs
    forced = tuple(accept or ())
    unknown = [name for name in forced if name not in base.singles]
    if unknown:
        raise AllRunsFailed(
            f"{', '.join(unknown)} cannot be accepted: of its {plan.extension} simulations fewer "
            f"than {MIN_LEARN} succeeded; mend the simulator, or accept another effect"
        )
    first = [study.candidate(base, single) for single in base.singles.values()]
    found = {candidate.names: candidate for candidate in first}
    for one in near_best(first, plan.refits):
        found[one.names], runs = _refit(study, base, one, runs, plan.most)
    if not any(one.accepted for one in found.values()):
        pairs, runs = _pairs(study, base, found, runs)
        found |= {pair.names: pair for pair in pairs}
    accepted = [one for one in found.values() if one.accepted]
    singles = [one for one in accepted if len(one.names) == 1]
    if forced and not (forced in found and found[forced].refitted):
        unrefined = _unrefined(study, base, found, forced, runs)
        found[forced], _ = _refit(study, base, unrefined, runs, most=None)
    return list(found.values()), singles or accepted


def _unrefined(
    study: Study,
    base: Base,
    found: Mapping[tuple[str, ...], Candidate],
    names: tuple[str, ...],
    runs: Runs,
) -> Candidate:
    """Effects that were simulated one by one, as if together: wherever any of them was."""
    d, box = len(base.box.low), base.box
    for name in names:
        within = found[(name,)].hypothesis.within
        box = hull(box, Box(within.low[:d], within.high[:d]))
    hypothesis = study.hypothesis(names, runs, with_whole_priors(box, len(names)))
    return study.candidate(base, hypothesis)


def _refit(
    study: Study, base: Base, candidate: Candidate, runs: Runs, most: int | None
) -> tuple[Candidate, Runs]:
    """Simulate a candidate near its optimum and fit it again.

    That ends when the optimum lies well inside the box of the latest runs, after REFIT_PASSES
    passes, where more than `most` runs would be made, or where none can be made: the candidate is
    then what it was, and without a first pass not refitted.
    """
    names = candidate.names
    for attempt in range(REFIT_PASSES):
        if most is not None and len(runs) - base.given + study.plan.refit > most:
            break
        fitted = candidate.hypothesis
        # what is best at the end of what was simulated is looked for well beyond
        least = LATER_HALF_WIDTH if fitted.within.encloses(fitted.u) else FIRST_HALF_WIDTH
        box = around(fitted.u, fitted.sd, least)
        phase = f"refit {' '.join(names)} {attempt}"
        try:
            made = study.run(phase, box, names, study.plan.refit)
        except AllRunsFailed:
            break
        runs = joined([runs, made])
        within = hull(fitted.within, box)
        candidate = study.candidate(base, study.hypothesis(names, runs, within), refitted=True)
        if box.encloses(candidate.hypothesis.u):
            break
    return candidate, runs


def _pairs(
    study: Study, base: Base, found: dict[tuple[str, ...], Candidate], runs: Runs
) -> tuple[list[Candidate], Runs]:
    """Fit the best effect with each other one; a pair counts if it gains more than either alone.

    Single effects of an accepted pair are refitted in `found`.
    """
    if not found:  # no effect could be simulated
        return [], runs
    best = max(found.values(), key=lambda c: c.gain)
    pairs = [
        _unrefined(study, base, found, (*best.names, other), runs)
        for other in base.singles
        if other not in best.names
    ]
    tried = []
    for pair in sorted(pairs, key=lambda c: -c.gain)[: study.plan.refits]:
        again, runs = _refit(study, base, pair, runs, study.plan.most)
        if again.accepted:
            for name in again.names:
                if not found[(name,)].refitted:
                    alone = found[(name,)]
                    found[(name,)], runs = _refit(study, base, alone, runs, study.plan.most)
            best_alone = max(found[(name,)].gain for name in again.names)
            again = replace(again, needed=again.gain > best_alone + SECOND_EFFECT_GAIN)
        tried.append(again)
    return tried, runs
