"""Kinds of verdict, and the probability from which a name is not called probable."""

from enum import StrEnum

CERTAIN = 0.95  # probability, on held-out data
MAX_STATED = 0.995  # probability above which a person is told "over 99 %": none is certain
NONE, OTHER = "none", "none of these"  # explanations without a known effect


class VerdictKind(StrEnum):
    """The conclusion of a criticism, equal to its spelling."""

    AGREEMENT = "none"
    EFFECT = "effect"
    TIE = "tie"
    UNKNOWN = "unknown"

    @property
    def advice(self) -> str:
        """Its meaning, and what to do next."""
        return _ADVICE[self]


_ADVICE = {
    VerdictKind.AGREEMENT: "No missing effect was detected. The SNR of an effect shows whether "
    "these data could have revealed it.",
    VerdictKind.EFFECT: "The named effect explains the difference. Use the extended model, and "
    "confirm the effect on held-out data.",
    VerdictKind.TIE: "Several effects explain the data equally well. Make the suggested experiment "
    "and criticise again.",
    VerdictKind.UNKNOWN: "Model and data differ and no known effect explains it. Look where they "
    "differ, and add an extension that acts there.",
}
