"""Probabilities of the explanations of data, and the conclusion that follows from them.

Before the data, something is missing or not (`PRIOR`); each known effect is as probable as another,
and so is each pair. The data change this by how probable they are under an explanation: its
likelihood at the best parameters, times the share of the prior that is as good (Laplace's
approximation; MacKay 2003, chapter 28), times the predictive density of held-out data. All
explanations are wrong if something else is missing. Then the p-value of the most probable one is
small: it has the distribution Beta(`WRONG_P`, 1) of Sellke, Bayarri and Berger (2001), and is
uniform if that one is right.

A conclusion costs as much as the number of explanations that it leaves, and may miss the right one
with the probability 1 - `CREDIBLE`: the smallest set that holds it with the probability `CREDIBLE`
costs least.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import comb

import numpy as np

from .held_out import Gap, holds
from .hypothesis import Hypothesis
from .misfit import ACCEPTANCE_LEVEL, REPLICATES, Check
from .verdict_kind import CERTAIN, MAX_STATED, NONE, OTHER, VerdictKind

REJECTION_LEVEL = 0.05  # p-value below which explanations are looked for
MIN_GAIN = 2.0  # log likelihood below which an effect explains nothing
FAR_BEHIND = 0.5  # of the best gain, below which one that does not pass is not worth more runs
NEGLIGIBLE = 0.05  # of the best one's probability, below which a pair is not worth runs
CREDIBLE = 0.9  # probability that the right explanation is among those that are named
WRONG_P = 0.01  # so that a p-value of 0.01 is as probable under a right and a wrong explanation
P_VALUE_STEP = 3.0 / (REPLICATES + 1.0)  # the smallest of a test that looks at two statistics


@dataclass(frozen=True)
class Priors:
    """Probabilities before the data; all explanations of a kind are equally probable.

    Attributes:
        none: Nothing is missing.
        one, two: One of the known effects is missing, or a pair of them.
        other: Something else is.
    """

    none: float = 0.5
    one: float = 0.35
    two: float = 0.05
    other: float = 0.1

    def share(self, acting: int, effects: int) -> float:
        """Prior probability of one explanation by `acting` of `effects` known effects."""
        return (self.one if acting == 1 else self.two) / comb(effects, acting)


PRIOR = Priors()


@dataclass(frozen=True, eq=False)
class Candidate:
    """An explanation, tested like the base model.

    Attributes:
        hypothesis: The extended model.
        check: Its own test.
        gain: Log likelihood beyond the base model's, under the base model's covariances.
        occam: Log of the share of the coefficients' prior that explains the data as well.
        refitted: Whether runs near its best parameters were made for it; what was not is not
            accepted.
        promise: Gain that the effect's score promises: the base model's score, or of a pair that of
            the model with its other effect.
        gaps: On the held-out data, where it was compared with them.
        unpredicted: Why it could not be simulated for held-out data; "" where it could.
    """

    hypothesis: Hypothesis
    check: Check
    gain: float
    occam: float = 0.0
    refitted: bool = False
    promise: float = 0.0
    gaps: tuple[Gap, ...] = ()
    unpredicted: str = ""

    @property
    def potential(self) -> float:
        """Gain that it may have; the few runs of a first fit may not come near to it."""
        return self.gain if self.refitted else max(self.gain, self.promise)

    @property
    def names(self) -> tuple[str, ...]:
        return self.hypothesis.names

    @property
    def held(self) -> bool:
        """Whether it held on the held-out data, where there were any."""
        return not self.unpredicted and holds(self.gaps)

    @property
    def seen(self) -> bool:
        """Whether held-out data, if there were any, show a gap that it could explain."""
        return not self.gaps or any(gap.before > gap.floor for gap in self.gaps)

    @property
    def evidence(self) -> float:
        """Log probability of all data beyond the base model's, that of the held-out data
        included."""
        return self.gain + self.occam + sum(one.evidence for one in self.gaps)

    @property
    def passes(self) -> bool:
        """The test that the base model failed, and it explains something."""
        return self.check.p_value > ACCEPTANCE_LEVEL and self.gain > MIN_GAIN

    @property
    def accepted(self) -> bool:
        return self.passes and self.refitted and self.held


@dataclass(frozen=True)
class Verdict:
    """The conclusion.

    Attributes:
        kind: AGREEMENT: no difference between model and data was detected. EFFECT: `effects`
            explain the difference. TIE: one of `effects` does. UNKNOWN: they differ, and no
            known effect explains it.
        effects: Their names.
        p_value: Of the base model.
        probability: Probability that this conclusion is right: of effects, that they are missing,
            alone or with another; of a tie, that the right explanation is among those named.
        reason: The conclusion in a sentence.
        perhaps: Effects that may act besides, and the probability that they do.
    """

    kind: VerdictKind
    effects: tuple[str, ...]
    p_value: float
    probability: float
    reason: str
    perhaps: Mapping[str, float] = field(default_factory=dict)


def log_weight(one: Candidate, effects: int) -> float:
    """Log of an explanation's prior probability times that of all data beyond the base model's;
    `effects` are known."""
    return float(np.log(PRIOR.share(len(one.names), effects))) + one.evidence


def may_rival(pair: Candidate, best: Candidate, effects: int) -> bool:
    """Whether a pair that was not refitted may be nearly as probable as one of its effects."""
    reach = log_weight(pair, effects) + pair.potential - pair.gain
    return reach > log_weight(best, effects) + np.log(NEGLIGIBLE)


def near_best(candidates: Sequence[Candidate], count: int) -> list[Candidate]:
    """Those worth a refit, best first."""
    least = FAR_BEHIND * max((c.potential for c in candidates), default=0.0)
    # one that passes already must be looked at, however far behind
    worth = [c for c in candidates if c.potential > max(least, 0.0) or c.passes]
    ranked = sorted(worth, key=lambda c: -c.potential)
    others = sorted(ranked[1:], key=lambda c: (not c.passes, -c.potential))
    return (ranked[:1] + others)[:count]


def probabilities(base: Check, candidates: Sequence[Candidate], effects: int) -> dict[str, float]:
    """Probability of "none", of each explanation and of "none of these"; they sum to 1.

    An explanation that passes but was not refitted, or that cannot be simulated for the held-out
    data, adds to "none of these".

    Args:
        base: Test of the base model, "none".
        candidates: Explanations that were fitted.
        effects: Number of known effects, fitted or not.
    """
    names = [NONE, *(label(one.names) for one in candidates)]
    logs = np.array([np.log(PRIOR.none), *(log_weight(one, effects) for one in candidates)])
    weight = np.exp(logs - logs.max())
    best = int(np.argmax(weight))
    tests = [base.p_value]
    if best:
        chosen = candidates[best - 1]
        tests = [chosen.check.p_value, *(gap.p_value for gap in chosen.gaps)]
    other = PRIOR.other / (1.0 - PRIOR.other) * weight.sum() / _fit_ratio(tests)
    untested = [one.unpredicted or (one.passes and not one.refitted) for one in candidates]
    tested = ~np.array([False, *map(bool, untested)])
    joint = np.append(weight * tested, other + weight[~tested].sum())
    return dict(zip([*names, OTHER], (joint / joint.sum()).tolist(), strict=True))


def _fit_ratio(p_values: Sequence[float]) -> float:
    """Bayes factor of a right over a wrong explanation, of the smallest of its p-values.

    The bootstrap has finite steps, so both probabilities are those of a step.
    """
    step = P_VALUE_STEP * len(p_values)
    p = float(np.clip(len(p_values) * min(p_values), step, 1.0))
    return step / (p**WRONG_P - max(p - step, 0.0) ** WRONG_P)


def label(names: Sequence[str]) -> str:
    """An explanation by its effects' names, for a person and for tables."""
    return " with ".join(names) or NONE


def credible(probability: Mapping[str, float]) -> list[str]:
    """Labels of the smallest set that holds the right explanation with the probability `CREDIBLE`,
    most probable first."""
    ordered = sorted(probability, key=lambda name: -probability[name])
    reached = np.cumsum([probability[name] for name in ordered])
    return ordered[: 1 + int(np.searchsorted(reached, CREDIBLE - 1e-12))]


def remaining(probability: Mapping[str, float], candidates: Sequence[Candidate]) -> list[Candidate]:
    """The credible explanations, most probable first.

    There are none where "none" or "none of these" is credible, where the most probable explanation
    was not accepted, or where the held-out data show no gap that the one to be named could explain.
    """
    by_label = {label(one.names): one for one in candidates}
    found = credible(probability)
    if not set(found) <= by_label.keys() or not by_label[found[0]].accepted:
        return []
    members = [by_label[name] for name in found]
    named = in_common(members)
    return members if named is None or named.seen else []


def in_common(members: Sequence[Candidate]) -> Candidate | None:
    """The accepted explanation that is a part of all of them, if there is one."""
    for one in members:
        if one.accepted and all(set(one.names) <= set(other.names) for other in members):
            return one
    return None


def conclude(
    base: Check,
    candidates: Sequence[Candidate],
    probability: Mapping[str, float],
    level: float = REJECTION_LEVEL,
) -> Verdict:
    """Conclude from the base model's test and the probabilities of explanations.

    Args:
        base: Test of the base model.
        candidates: Explanations that were looked for.
        probability: See `probabilities`.
        level: p-value below which the model and the data may differ.
    """
    p, members = base.p_value, remaining(probability, candidates)
    if p >= level or credible(probability)[0] == NONE:
        lacks_nothing = probability[NONE]
        sure = f"{_percent(lacks_nothing)} that nothing is missing"
        reason = f"Model and data agree (p = {p:.2g}, {sure})."
        return Verdict(VerdictKind.AGREEMENT, (), p, lacks_nothing, reason)
    differ = f"Model and data differ (p = {p:.2g}); "
    if not members:
        reason = differ + _unexplained(candidates, probability)
        return Verdict(VerdictKind.UNKNOWN, (), p, probability[OTHER], reason)
    reached = sum(probability[label(one.names)] for one in members)
    named = in_common(members)
    names = dict.fromkeys(name for one in members for name in one.names)
    if named is None:
        tied = " or ".join(label(one.names) for one in members)
        tie = f"{tied} explains it ({_percent(reached)}), and these data do not distinguish them."
        return Verdict(VerdictKind.TIE, tuple(names), p, reached, differ + tie)
    confirmed = named.gaps and reached >= CERTAIN
    explains = f"{label(named.names)} {'' if confirmed else 'probably '}explains it"
    perhaps = {
        name: sum(probability[label(one.names)] for one in members if name in one.names)
        for name in names
        if name not in named.names
    }
    each = " or ".join(f"{name} ({_percent(share)})" for name, share in perhaps.items())
    besides = f", perhaps together with {each}" if perhaps else ""
    reason = f"{differ}{explains} ({_percent(reached)}){besides}."
    return Verdict(VerdictKind.EFFECT, named.names, p, reached, reason, perhaps)


def _unexplained(explanations: Sequence[Candidate], probability: Mapping[str, float]) -> str:
    best = credible(probability)[0]
    refuted = [label(one.names) for one in explanations if one.passes and not one.held]
    if refuted:
        return (
            f"{' or '.join(refuted)} explains the fitted data but fails on held-out data. The "
            "missing effect is unknown."
        )
    if best == OTHER:
        return f"no known effect explains it ({_percent(probability[OTHER])})."
    return (
        f"{best} may explain it ({_percent(probability[best])}), which these data do not confirm."
    )


def _percent(probability: float) -> str:
    """A probability for a person."""
    return f"{probability:.0%}" if probability < MAX_STATED else "over 99%"
