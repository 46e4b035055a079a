"""How many there have been, and how many a second."""

from typing import NamedTuple

RATE_WINDOW = 1.0  # [s]


class Rate(NamedTuple):
    """A count, and its rate over the last `RATE_WINDOW` that is complete.

    Attributes:
        total: In all.
        rate: Per second; 0 until the first window is over.
        start: Of the window [s].
        counted: When the window started.
    """

    total: int
    rate: float
    start: float
    counted: int


def no_rate(now: float) -> Rate:
    """Nothing counted yet."""
    return Rate(0, 0.0, now, 0)


def counted(rate: Rate, more: int, now: float) -> Rate:
    """The rate after `more` have come, at time `now` [s]."""
    total = rate.total + more
    passed = now - rate.start
    if passed < RATE_WINDOW:
        return rate._replace(total=total)
    return Rate(total, (total - rate.counted) / passed, now, total)
