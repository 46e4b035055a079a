"""A camera's stamps against this computer's clock, from the first frame to the last."""

import math
from collections import deque
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

CLOCK_RATES = 0.5, 2.0
"""Of stamps against time: outside they are no clock's, or one's of another unit."""


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


class _Seen(NamedTuple):
    """A frame: its place among all that were taken, its index, its stamp and its arrival [s]."""

    row: int
    frame: int
    stamp: float
    host: float

    @property
    def distance(self) -> float:
        """Between this computer's clock and the camera's [s]."""
        return self.host - self.stamp


class StampWatch:
    """Judges one stamp after the other; that a clock is lost does not change any more.

    Where two stamps contradict each other either may be wrong. The later ones are, unless more of
    them agree than they contradict: then a wrong one has been taken for right, and is given up.

    Attributes:
        fault: From where on the stamps are no times; None while they are.
        left_out: Rows of the frames whose stamps are no times so far, counted from 0.
    """

    def __init__(self) -> None:
        self.fault: StampFault | None = None
        self.left_out: set[int] = set()
        self._rows = 0
        self._first = float("nan")  # time of arrival
        self._usual: list[_Seen] = []  # good ones from which the distance is learned
        self._latest: deque[_Seen] = deque(maxlen=MAX_BAD_STAMPS + 1)  # good ones
        self._distance = float("nan")  # median of the usual ones
        self._bad: list[_Seen] = []  # since the latest good one

    def take(self, index: int, stamp: float, host: float) -> None:
        """Judge the next frame's stamp.

        Args:
            index: Of the frame.
            stamp: On the camera's clock [s].
            host: Of its arrival on this computer's clock [s].
        """
        seen = _Seen(self._rows, index, stamp, host)
        self._rows += 1
        if math.isnan(self._first):
            self._first = host
        if self.fault is None and self._is_good(seen):
            self._trust([seen])
            return
        self.left_out.add(seen.row)
        if self.fault is not None:
            return
        self._bad.append(seen)
        agreeing = _agreeing(self._bad)
        against = self._contradicted(agreeing)
        if len(agreeing) > len(against):
            self._distrust(against)
            self._trust(agreeing)
        elif len(self._bad) > MAX_BAD_STAMPS:
            first = self._bad[0]
            self.fault = StampFault(first.frame, first.host - self._first, self._told())

    def _is_good(self, seen: _Seen) -> bool:
        if not math.isfinite(seen.stamp) or (self._latest and seen.stamp <= self._latest[-1].stamp):
            return False
        return not self._usual or self._is_near(seen, self._distance)

    def _is_near(self, seen: _Seen, distance: float) -> bool:
        allowed = MAX_APART + MAX_DRIFT * abs(seen.host - self._first)
        return abs(seen.distance - distance) <= allowed

    def _trust(self, good: list[_Seen]) -> None:
        self.left_out.difference_update(one.row for one in good)
        self._latest.extend(good)
        self._bad.clear()
        if len(self._usual) < SETTLING_FRAMES:
            self._usual.extend(good[: SETTLING_FRAMES - len(self._usual)])
            self._distance = float(np.median([one.distance for one in self._usual]))

    def _distrust(self, wrong: set[_Seen]) -> None:
        self.left_out.update(one.row for one in wrong)
        self._usual = [one for one in self._usual if one not in wrong]
        kept = [one for one in self._latest if one not in wrong]
        self._latest.clear()
        self._latest.extend(kept)

    def _contradicted(self, later: list[_Seen]) -> set[_Seen]:
        """Good ones that cannot be right if these are, by their order or by another distance."""
        if not later:
            return set()
        distance = float(np.median([one.distance for one in later]))
        after = {one for one in self._latest if one.stamp >= later[0].stamp}
        return after | {one for one in self._usual if not self._is_near(one, distance)}

    def _told(self) -> str:
        """What is wrong with the bad ones, by their rate and by the step to them."""
        stamps = np.array([one.stamp for one in self._bad])
        hosts = np.array([one.host for one in self._bad])
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


def _agreeing(seen: list[_Seen]) -> list[_Seen]:
    """The last ones that may be times of one clock: they rise as time does."""
    for start in range(len(seen)):
        part = seen[start:]
        stamps = np.array([one.stamp for one in part])
        if np.isfinite(stamps).all() and (np.diff(stamps) > 0.0).all() and _keep_time(part):
            return part
    return []


def _keep_time(seen: list[_Seen]) -> bool:
    distances = [one.distance for one in seen]
    spent = seen[-1].host - seen[0].host
    if max(distances) - min(distances) > MAX_APART:
        return False
    least, most = CLOCK_RATES
    return len(seen) == 1 or least * spent < seen[-1].stamp - seen[0].stamp < most * spent


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
    for at, seen, came in zip(index.tolist(), stamp.tolist(), host.tolist(), strict=True):
        watch.take(int(at), seen, came)
    good = np.ones(len(stamp), bool)
    good[list(watch.left_out)] = False
    return JudgedStamps(good, "" if watch.fault is None else str(watch.fault))
