"""The search for the effect that a model lacks."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..prior import Prior
from ..simulations.compute import Compute
from .experiment import Experiment, Extensions
from .hypothesis import Hypothesis, Weighted, weighted_posterior
from .misfit import Check, Signature, scored_on_clean, signature
from .runs import FIRST_HALF_WIDTH, LATER_HALF_WIDTH, PriorBox, Runs, joined, sides
from .study import MIN_EFFECT_RUNS, AllRunsFailed, Plan, Report, Study, silent
from .verdict import FAR_BEHIND, Candidate, may_rival, near_best

BASE_PASSES = 6  # of runs of the base model, those after the first only until the fit is settled
REFIT_PASSES = 4  # and of an explanation
FULL_PASS = 8  # runs of a pass of refits, at least: fewer passes, and fuller calls
SETTLED_GAIN = 4.0  # log likelihood by which a pass of runs may change a settled fit
MAX_DOUBT = 1.0  # of a settled fit
SIDE_SHARES = (0.7, 0.35)  # of the prior quantiles from neutral to an end: where effects are tried
LOOK = "look"  # phase of the first runs of effects where they seem to fit best
CLEAN_PASSES = 2  # of runs where the model fits clean data best: so far, and with the first's runs
CLEAN_RUNS = 2  # of each; the mean of the last is free of the emulator's error


class Base(NamedTuple):
    """The base model and what the effects would do to it.

    Attributes:
        hypothesis, check: The fitted model and its test.
        null: Residuals of a right model [m, n].
        signatures, singles: Of each effect that could be simulated: what it changes, and the model
            in which it acts.
        untested: Effects of which too few simulations succeeded, and the first one's error.
        inert: Effects that changed no signal, as if the simulator did not read their coefficients.
        box: In which effects were simulated.
        runs: All of them.
    """

    hypothesis: Hypothesis
    check: Check
    null: np.ndarray
    signatures: dict[str, Signature]
    singles: dict[str, Hypothesis]
    untested: dict[str, str]
    inert: tuple[str, ...]
    box: PriorBox
    runs: Runs


def fit_base(study: Study, earlier: Runs | None) -> tuple[Hypothesis, Runs, PriorBox]:
    """Fit the base model near its optimum. Return the fit, its runs and the box of the first."""
    whole = PriorBox.whole(len(study.prior))
    start = study.points(whole, (), study.plan.start)
    runs = study.run("start", start) if earlier is None else earlier
    fitted = study.hypothesis((), runs, whole)
    box = first = PriorBox.around(fitted.u, fitted.sd, FIRST_HALF_WIDTH)
    for attempt in range(BASE_PASSES):
        made = study.run(f"base {attempt}", study.points(box, (), study.plan.base))
        runs = joined([runs, made])
        before, fitted = fitted, study.hypothesis((), runs, whole)
        if settled(0.5 * (before.misfit(fitted) - fitted.misfit(fitted)), fitted, box):
            break
        box = PriorBox.around(fitted.u, fitted.sd, LATER_HALF_WIDTH / 2**attempt)
    return fitted, runs, first


def settled(gained: float, fitted: Hypothesis, box: PriorBox) -> bool:
    """Whether the runs in a box left a fit as good as it was, well known and inside of them."""
    return abs(gained) <= SETTLED_GAIN and fitted.doubt <= MAX_DOUBT and box.encloses(fitted.u)


def examine(study: Study, earlier: Runs | None) -> Base:
    """Fit the base model, learn every effect's signature, and test the model.

    The effects act at draws of the base model's posterior, with the same seeds: so what runs differ
    by is their doing, and one that needs what these data tell little of is seen, too.
    """
    base, runs, box = fit_base(study, earlier)
    tried = _screen(study, weighted_posterior(base, study.seed))
    neutral = tried.pop("")
    known = {name: of for name, of in tried.items() if len(of) >= MIN_EFFECT_RUNS}
    runs = joined([runs, neutral])
    base = study.hypothesis((), runs, base.within)
    within = box.extended(1)
    singles = {
        name: study.hypothesis((name,), joined([runs, of]), within) for name, of in known.items()
    }
    signatures = {
        name: signature(base, single, study.extensions[name]) for name, single in singles.items()
    }
    signatures = scored_on_clean(base, study.experiment.at(base.best).noise, signatures)
    tested, null = study.check(base, signatures)
    return Base(
        hypothesis=base,
        check=tested,
        null=null,
        signatures=signatures,
        singles=singles,
        untested={name: of.error for name, of in tried.items() if name not in known},
        inert=tuple(name for name, of in known.items() if _equal(of, neutral)),
        box=box,
        runs=joined([runs, *known.values()]),
    )


def _screen(study: Study, posterior: Weighted) -> dict[str, Runs]:
    """Runs at draws of the base model's posterior, of each effect and, under "", of none; where
    some fail, others are made nearer to neutral."""
    count = study.plan.extension
    drawn = posterior.draw(study.seed, count)
    found: dict[str, list[Runs]] = {name: [] for name in ("", *study.extensions)}
    for attempt, share in enumerate(SIDE_SHARES):
        lacking = [name for name, of in found.items() if sum(map(len, of)) < count]
        if attempt and not any(lacking):
            break
        asked = [
            drawn | ({name: sides(study.extensions[name], count, share)} if name else {})
            for name in lacking
        ]
        made = study.run_each(f"effects {attempt}", asked)
        for name, runs in zip(lacking, made, strict=True):
            found[name].append(runs)
    return {name: joined(of) for name, of in found.items()}


def _equal(one: Runs, other: Runs) -> bool:
    """Whether runs have the signals that others have of the same seeds."""
    signals = dict(zip(other.seeds.tolist(), other.signals, strict=True))
    pairs = zip(one.seeds.tolist(), one.signals, strict=True)
    return all(seed in signals and np.array_equal(signals[seed], signal) for seed, signal in pairs)


class OwnResidual(NamedTuple):
    """Residual of the base model on clean data, and where the model leaves it.

    Attributes:
        residual: Observed less the model's expectation [*signal_shape], NaN where missing.
        best: The most probable parameters.
    """

    residual: np.ndarray
    best: dict[str, float]


def own_residual(
    experiment: Experiment,
    prior: Prior,
    extensions: Extensions,
    compute: Compute,
    *,
    report: Report = silent,
    start: int = Plan.start,
) -> OwnResidual:
    """Residual of the calibrated base model on data in which no effect is expected.

    Args:
        compute: Where runs are made and kept.
        report: As in `criticise`.
        start: Runs all over the prior, before those where the model fits best.

    Raises:
        RuntimeError: every simulation failed, or the executor lost its workers.
    """
    study = Study(experiment, prior, extensions, compute, Plan(start=start), report=report)
    whole = PriorBox.whole(len(prior))
    runs = [study.run("start", study.points(whole, (), start))]
    fits = [study.hypothesis((), runs[0], whole)]
    for attempt in range(CLEAN_PASSES):
        at_best = {name: np.full(CLEAN_RUNS, value) for name, value in fits[-1].best.items()}
        runs.append(study.run(f"best {attempt}", at_best))
        fits.append(study.hypothesis((), joined(runs), whole))
    before, fitted = fits[-2:]
    now, then = fitted.expected(np.stack([fitted.u, before.u]))
    moved = fitted.surrogate.output.restore((now - then)[None])[0]
    return OwnResidual(experiment.observed - runs[-1].signals.mean(0) - moved, fitted.best)


def explain(
    study: Study, base: Base, accept: Sequence[str] | None = None
) -> tuple[list[Candidate], Candidate | None]:
    """Fit every explanation by one effect, and by pairs that may be as probable.

    Args:
        accept: Effects that are refitted together, whatever their rank.

    Returns:
        What was found, and the explanation by the effects to accept.

    Raises:
        AllRunsFailed: an effect to be accepted cannot be simulated.
    """
    plan = study.plan
    forced = tuple(accept or ())
    for name in forced:
        if name in base.untested:
            raise AllRunsFailed(
                f"{name} cannot be accepted: {base.untested[name]}; mend the simulator, or accept "
                "another effect"
            )
    search = Search(study, base)
    near = near_best(search.singles, 2 * plan.refits)
    if plan.look and len(near) > plan.refits:  # else all of them are refitted
        search.visit(LOOK, near, plan.look)
    search.refit(near_best(search.singles, plan.refits))
    search.try_pairs()
    found = list(search.found.values())
    return found, search.force(forced) if forced else None


def unsought(base: Base) -> list[Candidate]:
    """Explanations by one effect where none was looked for; first fits tell less than scores."""
    promised = promised_gains(base.check, base.signatures)
    return [
        Candidate(one, base.check, promised[name], one.occam, refitted=True)
        for name, one in base.singles.items()
    ]


def promised_gains(tested: Check, signatures: Mapping[str, Signature]) -> dict[str, float]:
    """Log likelihood that each effect may add to a tested model's: half of its squared score (Rao
    1948)."""
    scores = {name: tested.scores.get(name, 0.0) for name in signatures}
    onward = {
        name: max(one.side * scores[name], 0.0) if one.side else scores[name]
        for name, one in signatures.items()
    }
    return {name: 0.5 * score**2 for name, score in onward.items()}


class Search:
    """The explanations that were fitted so far, and the runs that they were learned from."""

    def __init__(self, study: Study, base: Base):
        self.study, self.base = study, base
        self.runs = base.runs
        self.counted = len(base.runs)  # those before are none of `Plan.most`
        self.limited = True
        promised = promised_gains(base.check, base.signatures)
        self.found = {
            of.names: self.candidate(of, promised[name]) for name, of in base.singles.items()
        }

    @property
    def singles(self) -> list[Candidate]:
        return [one for one in self.found.values() if len(one.names) == 1]

    def candidate(
        self, hypothesis: Hypothesis, promise: float, refitted: bool = False
    ) -> Candidate:
        """The extended model, tested."""
        tested, _ = self.study.check(hypothesis, self.base.signatures)
        gain = hypothesis.gain(self.base.hypothesis)
        return Candidate(hypothesis, tested, gain, hypothesis.occam, refitted, promise)

    def visit(
        self, phase: str, candidates: Sequence[Candidate], count: int, narrowing: int = 0
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
            least = LATER_HALF_WIDTH / 2**narrowing if near else FIRST_HALF_WIDTH
            boxes[one.names] = PriorBox.around(fitted.u, fitted.sd, least)
        left = study.plan.most - (len(self.runs) - self.counted)
        if self.limited:
            boxes = dict(list(boxes.items())[: max(left // count, 0)])
        if not boxes:
            return {}
        asked = [study.points(box, names, count) for names, box in boxes.items()]
        made = dict(zip(boxes, study.run_each(phase, asked), strict=True))
        boxes = {names: box for names, box in boxes.items() if len(made[names])}
        self.runs = joined([self.runs, *made.values()])
        for one in candidates:
            if one.names in boxes:
                within = one.hypothesis.within.hull(boxes[one.names])
                fitted = study.hypothesis(one.names, self.runs, within)
                self.found[one.names] = self.candidate(fitted, one.promise, one.refitted)
        return boxes

    def refit(self, candidates: Sequence[Candidate]) -> None:
        """Visit candidates until their fits are settled and pass, or are behind those that do.

        A fit that is not settled may come to what the effect's score promises.
        """
        for attempt in range(REFIT_PASSES):
            before = {one.names: one.gain for one in candidates}
            count = max(self.study.plan.refit, FULL_PASS // max(len(candidates), 1))
            boxes = self.visit(f"refit {attempt}", candidates, count, attempt)
            for names in boxes:
                self.found[names] = replace(self.found[names], refitted=True)
            tried = sorted((self.found[names] for names in boxes), key=lambda one: -one.gain)
            accepted = [one.gain for one in self.found.values() if one.accepted]
            best = max((one.gain for one in tried), default=0.0)
            due = max(accepted) - SETTLED_GAIN if accepted else FAR_BEHIND * best
            candidates = []
            for one in tried:
                gained = one.gain - before[one.names]
                known = settled(gained, one.hypothesis, boxes[one.names])
                reach = max(one.gain + abs(gained), 0.0 if known else one.promise)
                if reach > due and not (one.passes and known):
                    candidates.append(one)
            if not candidates:
                break

    def force(self, names: tuple[str, ...]) -> Candidate:
        """Refit the explanation by just these effects, whatever its rank."""
        known = (one for one in self.found.values() if set(one.names) == set(names))
        one = next(known, None) or self.together(names)
        if not one.refitted:
            self.found[one.names], self.limited = one, False
            self.refit([one])
        return self.found[one.names]

    def together(self, names: tuple[str, ...], promise: float = 0.0) -> Candidate:
        """Effects that were simulated one by one, as if together: wherever any of them was."""
        box = self.base.box
        for name in names:
            within = self.found[(name,)].hypothesis.within
            box = box.hull(PriorBox(*(end[: len(box.low)] for end in within)))
        fitted = self.study.hypothesis(names, self.runs, box.extended(len(names)))
        return self.candidate(fitted, promise)

    def try_pairs(self) -> None:
        """Fit the best effect with those that its residual seems to need, and refit the pairs that
        may be as probable. The effects of the best accepted pair are refitted one by one where the
        pair fits: each may come as far alone.

        Beside an effect that suffices there are none while its own fit is in doubt: a second
        coefficient would fit what the emulator errs by.
        """
        if not self.found:  # no effect could be simulated
            return
        self.counted = len(self.runs)
        best = max(self.singles, key=lambda c: c.gain)
        if any(one.accepted for one in self.singles) and best.hypothesis.doubt > MAX_DOUBT:
            return
        added = promised_gains(best.check, self.base.signatures)
        others = sorted(best.check.scores, key=lambda name: -added[name])
        # in the order of the registry: one pair has one name
        registry = list(self.study.extensions)
        pairs = [
            self.together(
                tuple(sorted((*best.names, other), key=registry.index)), best.gain + added[other]
            )
            for other in others[: 2 * self.study.plan.refits]
        ]
        pairs = [one for one in pairs if may_rival(one, best, len(registry))]
        pairs = sorted(pairs, key=lambda c: -c.potential)[: self.study.plan.refits]
        self.found |= {one.names: one for one in pairs}
        self.refit(pairs)
        accepted = [one for one in self.found.values() if len(one.names) > 1 and one.accepted]
        if accepted:
            pair = max(accepted, key=lambda c: c.evidence)
            alone = [self.found[(name,)] for name in pair.names]
            due = FAR_BEHIND * pair.gain, pair.gain - SETTLED_GAIN
            short = [one for one in alone if not one.refitted or due[0] < one.gain < due[1]]
            self.counted = len(self.runs)
            self.refit([_moved(one, pair) for one in short])


def _moved(one: Candidate, pair: Candidate) -> Candidate:
    """The explanation by one effect of a pair, where the pair fits best."""
    names, best, single = pair.hypothesis.fit.prior.names, pair.hypothesis.u, one.hypothesis
    other = {*pair.names} - {*one.names}
    u = np.array([at for name, at in zip(names, best, strict=True) if name not in other])
    within = single.within.hull(PriorBox.around(u, single.sd, LATER_HALF_WIDTH))
    return replace(one, hypothesis=replace(single, u=u, within=within))
