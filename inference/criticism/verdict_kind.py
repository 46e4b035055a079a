"""Kinds of verdict, and the probability from which a name is not called probable."""

from enum import StrEnum

CERTAIN = 0.95  # probability, on held-out data
MAX_STATED = 0.995  # probability above which "over 99 %" is printed: none is certain
NONE, OTHER = "none", "none of these"  # explanations without a known effect


class VerdictKind(StrEnum):
    """The conclusion of a criticism, equal to its spelling."""

    AGREEMENT = "none"
    EFFECT = "effect"
    TIE = "tie"
    UNKNOWN = "unknown"


def advice(kind: VerdictKind, *, confirmed: bool, suggested: bool) -> str:
    """What to do next.

    Args:
        kind: Of the verdict.
        confirmed: Whether the explanation holds on held-out data.
        suggested: Whether further experiments are suggested.
    """
    if kind is VerdictKind.AGREEMENT:
        return "Look whether the sizes that could hide matter to you."
    if kind is VerdictKind.UNKNOWN:
        return "Look where model and data differ, and add an extension that acts there."
    if kind is VerdictKind.TIE:
        return (
            "Make the suggested experiment and criticise again."
            if suggested
            else "Make an experiment that separates them, and criticise again with it held out."
        )
    return "Use the extended model." + (
        "" if confirmed else " Confirm it on held-out data before you trust it."
    )
