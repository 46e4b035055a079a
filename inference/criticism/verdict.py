"""Conclusions from the tests of a model and of its extensions."""

from collections.abc import Sequence
from dataclasses import dataclass

from .held_out import Gap, holds
from .hypothesis import Hypothesis
from .misfit import ACCEPTANCE_LEVEL, Check
from .verdict_kind import VerdictKind

REJECTION_LEVEL = 0.05  # p-value below which the base model is rejected
MIN_GAIN = 2.0  # log likelihood below which an effect explains nothing
FAR_BEHIND = 0.5  # of the best gain, below which one that does not pass is not worth more runs
TIE_MARGIN = 4.0  # log likelihood by which one explanation must excel another


@dataclass(frozen=True, eq=False)
class Candidate:
    """An explanation, tested like the base model.

    Attributes:
        hypothesis: The extended model.
        check: Its own test.
        gain: Log likelihood beyond the base model's, in the base model's metric.
        refitted: Whether runs near its best parameters were made for it; what was not is not
            accepted.
        needed: Whether, of several effects, each is needed.
        gaps: On the held-out data, where it was compared with them.
        unpredicted: Why it could not be simulated for held-out data; "" where it could.
    """

    hypothesis: Hypothesis
    check: Check
    gain: float
    refitted: bool = False
    needed: bool = True
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
    def evidence(self) -> float:
        """Log likelihood beyond the base model's, that of the held-out data included."""
        return self.gain + sum(one.lpd_gain for one in self.gaps)

    @property
    def passes(self) -> bool:
        """The test that the base model failed, and it explains something."""
        return self.check.p_value > ACCEPTANCE_LEVEL and self.gain > MIN_GAIN

    @property
    def accepted(self) -> bool:
        return self.passes and self.refitted and self.needed and self.held


@dataclass(frozen=True)
class Verdict:
    """The conclusion.

    Attributes:
        kind: AGREEMENT: no difference between model and data was detected. EFFECT: `effects`
            explain the difference. TIE: one of `effects` does. UNKNOWN: they differ, and no
            known effect explains it.
        effects: Their names.
        p_value: Of the base model.
        reason: The conclusion in a sentence.
    """

    kind: VerdictKind
    effects: tuple[str, ...]
    p_value: float
    reason: str


def near_best(candidates: Sequence[Candidate], count: int) -> list[Candidate]:
    """Those worth a refit, best first."""
    least = FAR_BEHIND * max((c.gain for c in candidates), default=0.0)
    # one that passes already must be looked at, however far behind
    worth = [c for c in candidates if c.gain > max(least, 0.0) or c.passes]
    ranked = sorted(worth, key=lambda c: -c.gain)
    others = sorted(ranked[1:], key=lambda c: (not c.passes, -c.gain))
    return (ranked[:1] + others)[:count]


def tied(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The accepted ones that the data cannot tell from the best of them, best first."""
    accepted = sorted((c for c in candidates if c.accepted), key=lambda c: -c.evidence)
    return [c for c in accepted if c.evidence > accepted[0].evidence - TIE_MARGIN]


def conclude(
    base: Check, explanations: Sequence[Candidate], level: float = REJECTION_LEVEL
) -> Verdict:
    """From the base model's test and the explanations that were tried, also on held-out data."""
    p, members = base.p_value, tied(explanations)
    if p >= level:
        return Verdict(VerdictKind.AGREEMENT, (), p, f"Model and data agree (p = {p:.2g}).")
    if not members:
        return Verdict(VerdictKind.UNKNOWN, (), p, _unexplained(p, explanations))
    if len(members) == 1:
        names = members[0].names
        reason = f"Model and data differ (p = {p:.2g}); {' with '.join(names)} explains it."
        return Verdict(VerdictKind.EFFECT, names, p, reason)
    names = tuple(dict.fromkeys(name for member in members for name in member.names))
    reason = (
        f"Model and data differ (p = {p:.2g}); one of {', '.join(names)} explains it, and these "
        "data do not distinguish them."
    )
    return Verdict(VerdictKind.TIE, names, p, reason)


def _unexplained(p: float, explanations: Sequence[Candidate]) -> str:
    refuted = [" with ".join(one.names) for one in explanations if not one.held]
    if not refuted:
        return f"Model and data differ (p = {p:.2g}), and no known effect explains it."
    return (
        f"Model and data differ (p = {p:.2g}); {' or '.join(refuted)} explains the fitted data "
        "but fails on held-out data. The missing effect is unknown."
    )
