"""A camera's stamps against this computer's clock, from the first frame to the last."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

SETTLING_FRAMES = 30
"""Frames from which the usual distance between the clocks is learned."""

MAX_APART = 0.5
"""Change of that distance [s] above which a stamp is no time of its frame: a computer that falls
behind fetches what a driver has kept for a few frames, and later steps show in the marker."""

MAX_DRIFT = 1e-3
"""Of the clocks against each other; those of computers and cameras differ by some 1e-5."""

MAX_BAD_STAMPS = 10
"""In a row, before the camera's clock counts as lost: it does not come back by itself."""


@dataclass(frozen=True)
class StampFault:
    """From where on a camera's stamps are no times.

    Attributes:
        index: Of the first such frame.
        after: Since the camera's first frame, on this computer's clock [s].
        what: Is wrong with them.
    """

    index: int
    after: float
    what: str

    def __str__(self) -> str:
        return f"its stamps {self.what} from frame {self.index} on ({self.after:.1f} s)"


class StampWatch:
    """Judges one stamp after the other; what it has concluded does not change any more."""

    def __init__(self) -> None:
        self.fault: StampFault | None = None
        self._first = self._stamp = float("nan")  # time of arrival; the last good stamp
        self._usual: list[float] = []
        self._distance = float("nan")  # median of the usual ones
        self._bad: list[tuple[int, float, float]] = []

    def take(self, index: int, stamp: float, host: float) -> bool:
        """Whether a frame's stamp is a time that follows the earlier ones.

        Args:
            index: Of the frame.
            stamp: On the camera's clock [s].
            host: Of its arrival on this computer's clock [s].
        """
        if math.isnan(self._first):
            self._first = host
        if self.fault is not None:
            return False
        if self._is_good(stamp, host):
            self._stamp = stamp
            if len(self._usual) < SETTLING_FRAMES:
                self._usual.append(host - stamp)
                self._distance = float(np.median(self._usual))
            self._bad.clear()
            return True
        self._bad.append((index, stamp, host))
        if len(self._bad) > MAX_BAD_STAMPS:
            first, _, came = self._bad[0]
            self.fault = StampFault(first, came - self._first, self._told())
        return False

    def _is_good(self, stamp: float, host: float) -> bool:
        if not math.isfinite(stamp) or stamp <= self._stamp:
            return False
        allowed = MAX_APART + MAX_DRIFT * (host - self._first)
        return not self._usual or abs(host - stamp - self._distance) <= allowed

    def _told(self) -> str:
        """What is wrong with the bad ones, by their rate and by the step to them."""
        _, stamps, hosts = (np.array(column) for column in zip(*self._bad, strict=True))
        if not np.isfinite(stamps).all():
            return "are no numbers"
        spent = hosts[-1] - hosts[0]
        rate = (stamps[-1] - stamps[0]) / spent if spent > 0.0 else float("nan")
        if abs(rate) < 0.05:
            return "stand still"
        if rate < 0.0:
            return "go backwards"
        if not 0.5 < rate < 2.0:
            return f"run {rate:.3g} times as fast as time, which looks like another unit,"
        step = self._distance - float(np.median(hosts - stamps))
        return f"jump by {step:+.2f} s"


class JudgedStamps(NamedTuple):
    """The stamps of all frames of a camera.

    Attributes:
        good: Which of them are times that follow each other, bool (N,).
        fault: Why the later ones are none; empty where nothing is wrong.
    """

    good: NDArray[np.bool_]
    fault: str

    @property
    def left_out(self) -> int:
        """Number of frames whose stamp is no time."""
        return int((~self.good).sum())


def judged_stamps(index: NDArray, stamp: NDArray, host: NDArray) -> JudgedStamps:
    """Judge stamps [s] by the times of arrival [s] of their frames; all of shape (N,)."""
    watch = StampWatch()
    rows = zip(index.tolist(), stamp.tolist(), host.tolist(), strict=True)
    good = [watch.take(int(at), seen, came) for at, seen, came in rows]
    return JudgedStamps(np.array(good, bool), "" if watch.fault is None else str(watch.fault))
