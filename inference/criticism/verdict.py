"""Probabilities of the explanations of data, and the conclusion that follows from them.

Before the data, something is missing or not (`PRIOR`); each known effect is as probable as another,
and so is each pair. The data change this by how probable they are under an explanation: its
likelihood at the best parameters, times the share of the prior that is as good (Laplace's
approximation; MacKay 2003, chapter 28), times the predictive density of held-out data. All
explanations are wrong if something else is missing. Then the p-value of the best is small: it has
the distribution Beta(`WRONG_P`, 1) of Sellke, Bayarri and Berger (2001), and is uniform under the
right one.

A conclusion costs as much as the number of explanations that it leaves, and may miss the right one
with the probability 1 - `CREDIBLE`: so it is the smallest set that holds it with that probability.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .held_out import Gap, holds
from .hypothesis import Hypothesis
from .misfit import ACCEPTANCE_LEVEL, REPLICATES, Check
from .verdict_kind import CERTAIN, VerdictKind

REJECTION_LEVEL = 0.05  # p-value below which explanations are looked for
MIN_GAIN = 2.0  # log likelihood below which an effect explains nothing
FAR_BEHIND = 0.5  # of the best gain, below which one that does not pass is not worth more runs
TIE_MARGIN = 4.0  # log likelihood by which one explanation must excel another
CREDIBLE = 0.9  # probability that the right explanation is among those that are named
WRONG_P = 0.01  # so that a p-value of 0.01 is as probable under a right and a wrong explanation
P_VALUE_STEP = 3.0 / (REPLICATES + 1.0)  # the smallest of a test that looks at two statistics
NONE, OTHER = "none", "none of these"


@dataclass(frozen=True)
class Priors:
    """Probabilities before the data; what they are of shares them evenly.

    Attributes:
        none: Nothing is missing.
        one, two: One of the known effects is missing, or a pair of them.
        other: Something else is.
    """

    none: float = 0.5
    one: float = 0.35
    two: float = 0.05
    other: float = 0.1


PRIOR = Priors()


@dataclass(frozen=True, eq=False)
class Candidate:
    """An explanation, tested like the base model.

    Attributes:
        hypothesis: The extended model.
        check: Its own test.
        gain: Log likelihood beyond the base model's, in the base model's metric.
        occam: Log of the share of the coefficients' prior that explains the data as well.
        refitted: Whether runs near its best parameters were made for it; what was not is not
            accepted.
        requested: Whether it was refitted only because the user accepts it: it changes no verdict.
        gaps: On the held-out data, where it was compared with them.
        unpredicted: Why it could not be simulated for held-out data; "" where it could.
    """

    hypothesis: Hypothesis
    check: Check
    gain: float
    occam: float = 0.0
    refitted: bool = False
    requested: bool = False
    gaps: tuple[Gap, ...] = ()
    unpredicted: str = ""

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
        return not self.gaps or any(gap.unexplained[0] > 0.0 for gap in self.gaps)

    @property
    def evidence(self) -> float:
        """Log probability of all data beyond the base model's, that of the held-out data
        included."""
        return self.gain + self.occam + sum(one.lpd_gain for one in self.gaps)

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
        probability: That it is right; of a tie, that the right explanation is among those named.
        reason: The conclusion in a sentence.
    """

    kind: VerdictKind
    effects: tuple[str, ...]
    p_value: float
    probability: float
    reason: str


def near_best(candidates: Sequence[Candidate], count: int) -> list[Candidate]:
    """Those worth a refit, best first."""
    least = FAR_BEHIND * max((c.gain for c in candidates), default=0.0)
    # one that passes already must be looked at, however far behind
    worth = [c for c in candidates if c.gain > max(least, 0.0) or c.passes]
    ranked = sorted(worth, key=lambda c: -c.gain)
    others = sorted(ranked[1:], key=lambda c: (not c.passes, -c.gain))
    return (ranked[:1] + others)[:count]


def probabilities(base: Check, candidates: Sequence[Candidate], effects: int) -> dict[str, float]:
    """Probability of "none", of each explanation and of "none of these".

    What passes but was not refitted, and what cannot be simulated for the held-out data, counts as
    none of these.

    Args:
        base: Test of the base model, "none".
        candidates: Explanations that were fitted.
        effects: Number of known effects, fitted or not.
    """
    gaps = next((one.gaps for one in candidates if one.gaps), ())
    share = {1: PRIOR.one / effects, 2: PRIOR.two / max(effects * (effects - 1) / 2, 1)}
    names = [NONE, *(label(one.names) for one in candidates)]
    untested = [one.unpredicted or (one.passes and not one.refitted) for one in candidates]
    tested = ~np.array([False, *map(bool, untested)])
    prior = [PRIOR.none, *(share.get(len(one.names), share[2]) for one in candidates)]
    evidence = [0.0, *(one.evidence for one in candidates)]
    log_weight = np.log(prior) + evidence
    weight = np.exp(log_weight - log_weight.max())
    tests = [(base.p_value, *(gap.p_before for gap in gaps))]
    tests += [(one.check.p_value, *(gap.p_value for gap in one.gaps)) for one in candidates]
    joint = weight * [_fit_ratio(some) for some in tests]
    other = PRIOR.other / (1.0 - PRIOR.other) * weight.sum() + joint[~tested].sum()
    joint = np.append(joint * tested, other)
    return dict(zip([*names, OTHER], (joint / joint.sum()).tolist(), strict=True))


def _fit_ratio(p_values: Sequence[float]) -> float:
    """Probability of the smallest of several p-values if an explanation is right, over that if it
    is wrong; both are of a whole step, since the bootstrap does not tell smaller ones apart."""
    step = P_VALUE_STEP * len(p_values)
    p = float(np.clip(len(p_values) * min(p_values), step, 1.0))
    return step / (p**WRONG_P - max(p - step, 0.0) ** WRONG_P)


def label(names: Sequence[str]) -> str:
    """An explanation by its effects' names, for a person and for tables."""
    return " with ".join(names) or NONE


def credible(probability: Mapping[str, float]) -> list[str]:
    """The smallest set of explanations that holds the right one with the probability `CREDIBLE`,
    best first."""
    ordered = sorted(probability, key=lambda name: -probability[name])
    reached = np.cumsum([probability[name] for name in ordered])
    return ordered[: 1 + int(np.searchsorted(reached, CREDIBLE - 1e-12))]


def remaining(probability: Mapping[str, float], candidates: Sequence[Candidate]) -> list[Candidate]:
    """The explanations among the credible ones, best first; none where the model may lack nothing
    or something else.

    Where the held-out data show no gap they confirm nothing, and none is left alone.
    """
    found = credible(probability)
    accepted = [one for one in candidates if one.accepted]
    if not accepted or NONE in found or OTHER in found:
        return []
    ranked = sorted(accepted, key=lambda one: -probability[label(one.names)])
    count = max(len(found), 1 if ranked[0].seen else 2)
    return ranked[:count] if len(ranked) >= count else []


def conclude(
    base: Check,
    candidates: Sequence[Candidate],
    probability: Mapping[str, float],
    level: float = REJECTION_LEVEL,
) -> Verdict:
    """From the base model's test and the probabilities of explanations."""
    p, members = base.p_value, remaining(probability, candidates)
    if p >= level or NONE in credible(probability):
        lacks_nothing = probability[NONE]
        reason = f"Model and data agree (p = {p:.2g}, {lacks_nothing:.0%} that nothing is missing)."
        return Verdict(VerdictKind.AGREEMENT, (), p, lacks_nothing, reason)
    differ = f"Model and data differ (p = {p:.2g}); "
    if not members:
        reason = differ + _unexplained(candidates)
        return Verdict(VerdictKind.UNKNOWN, (), p, probability[OTHER], reason)
    reached = sum(probability[label(one.names)] for one in members)
    names = tuple(dict.fromkeys(name for member in members for name in member.names))
    if len(members) > 1:
        tie = f"one of {', '.join(names)} explains it ({reached:.0%}), and these data do not "
        return Verdict(VerdictKind.TIE, names, p, reached, f"{differ}{tie}distinguish them.")
    confirmed = members[0].gaps and reached >= CERTAIN
    explains = f"{label(names)} {'' if confirmed else 'probably '}explains it ({reached:.0%})."
    return Verdict(VerdictKind.EFFECT, names, p, reached, differ + explains)


def _unexplained(explanations: Sequence[Candidate]) -> str:
    unseen = [label(one.names) for one in explanations if one.passes and not one.seen]
    if unseen:
        return f"{unseen[0]} may explain it, but held-out data show no gap that would confirm it."
    refuted = [label(one.names) for one in explanations if one.passes and not one.held]
    if not refuted:
        return "no known effect explains it."
    return (
        f"{' or '.join(refuted)} explains the fitted data but fails on held-out data. The missing "
        "effect is unknown."
    )
