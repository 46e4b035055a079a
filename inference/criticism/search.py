"""The search for the effect that a model lacks."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .hypothesis import Hypothesis
from .misfit import Check
from .prior_boxes import (
    FIRST_HALF_WIDTH,
    LATER_HALF_WIDTH,
    PriorBox,
    around,
    everywhere,
    hull,
    sides,
    with_whole_priors,
)
from .runs import Runs, joined
from .signatures import Signature, scored_on_clean, signature
from .study import MIN_EFFECT_RUNS, AllRunsFailed, Study
from .verdict import FAR_BEHIND, TIE_MARGIN, Candidate, near_best

BASE_PASSES = 6  # of runs of the base model, those after the first only until the fit is settled
REFIT_PASSES = 4  # and of an explanation
FULL_PASS = 8  # runs of a pass of refits, at least: fewer passes, and fuller calls
MAX_DOUBT = 1.0  # of a settled fit: emulator's variance over all variance, summed over the data
SIDE_SHARES = (0.7, 0.35)  # of the prior quantiles from neutral to an end: where effects are tried
LOOK = "look"  # phase of the first runs of effects where they seem to fit best
SECOND_EFFECT_GAIN = 6.0  # log likelihood that a second effect must gain


class Base(NamedTuple):
    """The base model and what the effects would do to it."""

    hypothesis: Hypothesis
    check: Check
    null: np.ndarray  # [m, n], residuals of a right model
    signatures: dict[str, Signature]
    singles: dict[str, Hypothesis]
    box: PriorBox  # in which effects were simulated
    runs: Runs


def fit_base(study: Study, earlier: Runs | None) -> tuple[Hypothesis, Runs, PriorBox]:
    """Fit the base model near its optimum. Return the fit, its runs and the box of the first."""
    whole = everywhere(len(study.prior))
    start = study.points(whole, (), study.plan.start)
    runs = study.run("start", start) if earlier is None else earlier
    fitted = study.hypothesis((), runs, whole)
    box = first = around(fitted.u, fitted.sd, FIRST_HALF_WIDTH)
    for attempt in range(BASE_PASSES):
        made = study.run(f"base {attempt}", study.points(box, (), study.plan.base))
        runs = joined([runs, made])
        before, fitted = fitted, study.hypothesis((), runs, whole)
        if settled(0.5 * (before.misfit(fitted) - fitted.misfit(fitted)), fitted, box):
            break
        box = around(fitted.u, fitted.sd, LATER_HALF_WIDTH)
    return fitted, runs, first


def settled(gained: float, fitted: Hypothesis, box: PriorBox) -> bool:
    """Whether the runs in a box left a fit as good as it was, well known and inside of them."""
    doubt = np.trace(fitted.whiten(fitted.whiten(fitted.latent)))
    return abs(gained) <= TIE_MARGIN and doubt <= MAX_DOUBT and box.encloses(fitted.u)


def examine(study: Study, earlier: Runs | None) -> tuple[Base, tuple[str, ...]]:
    """Fit the base model, learn every effect's signature, and test the model.

    The effects act where the base model fits best, with the same seeds: so what runs differ by
    is their doing.

    Returns:
        What was found, and the effects of which too few simulations succeeded to learn from.
    """
    base, runs, box = fit_base(study, earlier)
    neutral, known = _screen(study, base.best)
    runs = joined([runs, *neutral])
    base = study.hypothesis((), runs, base.within)
    within = with_whole_priors(box, 1)
    singles = {
        name: study.hypothesis((name,), joined([runs, *of]), within) for name, of in known.items()
    }
    signatures = {
        name: signature(base, single, study.extensions[name]) for name, single in singles.items()
    }
    signatures = scored_on_clean(base, study.experiment.noise, signatures)
    tested, null = study.check(base, signatures)
    every = joined([runs, *sum(known.values(), [])])
    found = Base(base, tested, null, signatures, singles, box, every)
    return found, tuple(name for name in study.extensions if name not in known)


def _screen(study: Study, best: Mapping[str, float]) -> tuple[list[Runs], dict[str, list[Runs]]]:
    """Runs of the base model at its best parameters, and beside them of each effect of which at
    least two succeed; where some fail, others are made nearer to neutral."""
    count = study.plan.extension
    at_best = {name: np.full(count, value) for name, value in best.items()}
    found: dict[str, list[Runs]] = {name: [] for name in ("", *study.extensions)}
    for attempt, share in enumerate(SIDE_SHARES):
        lacking = [name for name, of in found.items() if sum(map(len, of)) < count]
        if attempt and not any(lacking):
            break
        asked = [
            at_best | ({name: sides(study.extensions[name], count, share)} if name else {})
            for name in lacking
        ]
        made = study.run_each(f"effects {attempt}", asked)
        for name, runs in zip(lacking, made, strict=True):
            found[name].append(runs)
    neutral = found.pop("")
    return neutral, {name: of for name, of in found.items() if sum(map(len, of)) >= MIN_EFFECT_RUNS}


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
    plan = study.plan
    forced = tuple(accept or ())
    unknown = [name for name in forced if name not in base.singles]
    if unknown:
        raise AllRunsFailed(
            f"{', '.join(unknown)} cannot be accepted: of its simulations fewer than "
            f"{MIN_EFFECT_RUNS} succeeded; mend the simulator, or accept another effect"
        )
    search = Search(study, base)
    near = near_best(search.singles, 2 * plan.refits)
    if plan.look and len(near) > plan.refits:  # else all of them are refitted
        search.visit(LOOK, near, plan.look)
    search.refit(near_best(search.singles, plan.refits))
    if not any(one.accepted for one in search.singles):
        search.try_pairs()
    accepted = [one for one in search.found.values() if one.accepted]  # whatever is forced
    if forced:
        search.force(forced)
    return list(search.found.values()), [one for one in accepted if len(one.names) == 1] or accepted


class Search:
    """The explanations that were fitted so far, and the runs that they were learned from."""

    def __init__(self, study: Study, base: Base):
        self.study, self.base = study, base
        self.runs = base.runs
        self.counted = len(base.runs)  # those before are none of `Plan.most`
        self.limited = True
        self.found = {of.names: self.candidate(of) for of in base.singles.values()}

    @property
    def singles(self) -> list[Candidate]:
        return [one for one in self.found.values() if len(one.names) == 1]

    def candidate(self, hypothesis: Hypothesis, refitted: bool = False) -> Candidate:
        """The extended model, tested."""
        metric = self.base.hypothesis
        gain = 0.5 * (metric.misfit(metric) - hypothesis.misfit(metric))
        tested, _ = self.study.check(hypothesis, self.base.signatures)
        return Candidate(hypothesis, tested, gain, refitted)

    def visit(
        self, phase: str, candidates: Sequence[Candidate], count: int
    ) -> dict[tuple[str, ...], PriorBox]:
        """Simulate each of them near its optimum, all in one call, and fit it again.

        Returns:
            The boxes in which that succeeded. No more runs than planned are made: of candidates
            for which they do not suffice none is made.
        """
        study, boxes = self.study, {}
        for one in candidates:
            fitted = one.hypothesis
            # what is best at the end of what was simulated is looked for well beyond
            near = one.refitted or phase != LOOK
            near = near and fitted.within.encloses(fitted.u)
            least = LATER_HALF_WIDTH if near else FIRST_HALF_WIDTH
            boxes[one.names] = around(fitted.u, fitted.sd, least)
        left = study.plan.most - (len(self.runs) - self.counted)
        if self.limited:
            boxes = dict(list(boxes.items())[: max(left // count, 0)])
        asked = [study.points(box, names, count) for names, box in boxes.items()]
        made = dict(zip(boxes, study.run_each(phase, asked), strict=True))
        boxes = {names: box for names, box in boxes.items() if len(made[names])}
        self.runs = joined([self.runs, *made.values()])
        for one in candidates:
            if one.names in boxes:
                within = hull(one.hypothesis.within, boxes[one.names])
                fitted = study.hypothesis(one.names, self.runs, within)
                self.found[one.names] = self.candidate(fitted, one.refitted)
        return boxes

    def refit(self, candidates: Sequence[Candidate]) -> None:
        """Visit candidates until their fits are settled and pass, or are behind those that do."""
        for attempt in range(REFIT_PASSES):
            before = {one.names: one.gain for one in candidates}
            count = max(self.study.plan.refit, FULL_PASS // max(len(candidates), 1))
            boxes = self.visit(f"refit {attempt}", candidates, count)
            for names in boxes:
                self.found[names] = replace(self.found[names], refitted=True)
            tried = sorted((self.found[names] for names in boxes), key=lambda one: -one.gain)
            accepted = [one.gain for one in self.found.values() if one.accepted]
            best = max((one.gain for one in tried), default=0.0)
            due = max(accepted) - TIE_MARGIN if accepted else FAR_BEHIND * best
            candidates = []
            for one in tried:
                gained = one.gain - before[one.names]
                done = one.passes and settled(gained, one.hypothesis, boxes[one.names])
                if one.gain + abs(gained) > due and not done:
                    candidates.append(one)
            if not candidates:
                break

    def force(self, names: tuple[str, ...]) -> None:
        """Refit the explanation by just these effects, whatever its rank."""
        known = (one for one in self.found.values() if set(one.names) == set(names))
        one = next(known, None) or self.together(names)
        if not one.refitted:
            self.found[one.names], self.limited = one, False
            self.refit([one])

    def together(self, names: tuple[str, ...]) -> Candidate:
        """Effects that were simulated one by one, as if together: wherever any of them was."""
        box = self.base.box
        for name in names:
            within = self.found[(name,)].hypothesis.within
            box = hull(box, PriorBox(*(end[: len(box.low)] for end in within)))
        within = with_whole_priors(box, len(names))
        return self.candidate(self.study.hypothesis(names, self.runs, within))

    def try_pairs(self) -> None:
        """Fit the best effect with those that its residual seems to need most; a pair counts if
        it gains more than either alone. Single effects of an accepted pair are refitted."""
        if not self.found:  # no effect could be simulated
            return
        self.counted = len(self.runs)
        best = max(self.singles, key=lambda c: c.gain)
        signatures = self.base.signatures

        def wanted(name: str) -> float:
            score, side = best.check.scores[name], signatures[name].side
            return side * score if side else abs(score)

        others = sorted(best.check.scores, key=wanted, reverse=True)[: 2 * self.study.plan.refits]
        pairs = [self.together((*best.names, other)) for other in others]
        pairs = sorted(pairs, key=lambda c: -c.gain)[: self.study.plan.refits]
        self.found |= {one.names: one for one in pairs}
        self.refit(pairs)
        tried = [self.found[one.names] for one in pairs]
        named = dict.fromkeys(name for one in tried if one.accepted for name in one.names)
        alone = [self.found[(name,)] for name in named]
        self.refit([one for one in alone if not one.refitted])
        for one in tried:
            best_alone = max(self.found[(name,)].gain for name in one.names)
            needed = one.gain > best_alone + SECOND_EFFECT_GAIN
            self.found[one.names] = replace(one, needed=needed)
