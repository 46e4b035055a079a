"""What may become of an effect as an explanation."""

from enum import StrEnum


class EffectStatus(StrEnum):
    """What became of an effect as an explanation; its spelling is that in criticism.nc."""

    NAMED = "named"
    POSSIBLE = "possible"
    LESS_LIKELY = "less likely"
    REFUTED = "refuted by held-out data"
    REJECTED = "rejected"
    NOT_NEEDED = "not needed"
    NOT_REFITTED = "untested by a refit"
    FAILED = "untested: its simulations failed"
