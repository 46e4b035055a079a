"""Queues before the motion loop, orders and paths, and behind it, samples; it never waits."""

import select
from collections import deque
from collections.abc import Generator
from multiprocessing.connection import Connection
from threading import Thread
from typing import NamedTuple

import numpy as np

from ..errors import MotionRejected
from ..motion.poses import cup_frame
from ..motion.stir_paths import PosePath
from ..process import hurry
from ..recorder.samples import Sample
from ..rig import Rig
from ..safety.guards import Trip
from ..safety.limits import Tool, path_checks, turn_between
from .orders import Ask, Follow, Leave, Stop

# of a path's first pose from the last set-point: paths join, but for rounding
START_ERROR = 1e-6  # m
START_TURN = 1e-5  # rad
SAMPLES_PER_MESSAGE = 5  # samples a message
# what a pipe takes at once where it takes anything is 4096 bytes; a sample needs about 250
MAX_SAMPLES_AT_ONCE = 12


class Leg(NamedTuple):
    """A checked path, as the `number`th order from 0.

    Attributes:
        number: Of the order.
        path: As it was ordered.
        base: Its poses in the base frame, shape (T, 6).
    """

    number: int
    path: PosePath
    base: np.ndarray


class Course(NamedTuple):
    """Current command: sample `at` of `leg`, or the pose `hold` when there is none.

    Attributes:
        hold: Latest set-point in the base frame, shape (6,).
        leg: The path that runs.
        at: Its sample.
        waiting: Paths that come after it.
    """

    hold: np.ndarray
    leg: Leg | None = None
    at: int = 0
    waiting: tuple[Leg, ...] = ()


class LegChange(NamedTuple):
    """Change of a period: the path that ended, the path that began."""

    done: Leg | None
    began: Leg | None


def queued(course: Course, leg: Leg) -> Course:
    """With one path more."""
    return course._replace(waiting=(*course.waiting, leg))


def advanced(course: Course) -> tuple[Course, LegChange]:
    """One period later. A tick that came late delays the path; it never hurries it."""
    leg = course.leg
    if leg is not None and course.at + 1 < len(leg.base):
        at = course.at + 1
        return course._replace(at=at, hold=leg.base[at]), LegChange(None, None)
    if course.waiting:
        first, *rest = course.waiting
        # what is commanded already is not commanded again: joined paths keep their time
        at = 1 if np.array_equal(first.base[0], course.hold) else 0
        moved = Course(first.base[at], leg=first, at=at, waiting=tuple(rest))
        return moved, LegChange(leg, first)
    return course._replace(leg=None), LegChange(leg, None)


class Trail:
    """The set-points of the last moment, and how far the arm is from them.

    The arm follows its set-points with a lag, so the nearest of them counts.
    """

    def __init__(self, pose: np.ndarray, samples: int):
        self._position = np.tile(pose[:3], (samples, 1))
        self._turn = np.tile(quaternion(pose[3:]), (samples, 1))
        self._next = 0

    def put(self, pose: np.ndarray) -> None:
        """Add a set-point; the oldest is forgotten."""
        self._position[self._next] = pose[:3]
        self._turn[self._next] = quaternion(pose[3:])
        self._next = (self._next + 1) % len(self._position)

    def error(self, pose: np.ndarray) -> tuple[float, float]:
        """Distance [m] and angle [rad] from the nearest set-points."""
        away = self._position - pose[:3]
        nearest = float(np.sqrt(np.einsum("ij,ij->i", away, away).min()))
        alike = float(np.abs(self._turn @ quaternion(pose[3:])).max())
        return nearest, 2.0 * float(np.arccos(min(alike, 1.0)))


def quaternion(rotvec: np.ndarray) -> np.ndarray:
    """Unit quaternion (w, x, y, z) of a rotation vector [rad]."""
    angle = float(np.linalg.norm(rotvec))
    scale = np.sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return np.array([np.cos(0.5 * angle), *(scale * np.asarray(rotvec))])


class Inbox:
    """Receives orders in a thread, which does nothing else."""

    def __init__(self, orders: Connection):
        self._orders = orders
        self._items: deque[object] = deque()

    def start(self) -> None:
        """Begin to receive."""
        Thread(target=self._receive, name="orders", daemon=True).start()

    def take(self) -> Follow | Trip | Ask | Leave | None:
        """The next order, or a reason to stop; None if nothing has come."""
        if not self._items:
            return None
        match self._items.popleft():
            case Stop(reason=reason):
                return Trip("stop", reason)
            case (Follow() | Ask() | Leave() | Trip()) as item:
                return item
            case other:
                return Trip("order", f"an order was refused: {other!r:.100} is none")

    def _receive(self) -> None:
        # as urgent as the loop: it must not be put aside while it holds Python's lock
        hurry()
        while True:
            try:
                self._items.append(self._orders.recv())
            except (EOFError, OSError):
                self._items.append(Trip("main", "the main process is gone"))
                return


class Vetting:
    """Checks paths a slice at a time: a whole one lasts longer than a tick.

    A path that breaks a limit is a reason to stop, for whoever sends that cannot be trusted with
    a moving arm.
    """

    def __init__(self, rig: Rig, tool: Tool, pose: np.ndarray, joints: np.ndarray):
        self._rig = rig
        self._tool: Tool = tool
        self._end = pose
        self._joints = joints
        self._waiting: deque[PosePath] = deque()
        self._count = 0
        self._current: Generator[None, None, Leg] | None = None

    @property
    def busy(self) -> bool:
        """Whether there are paths left to check."""
        return self._current is not None or bool(self._waiting)

    def add(self, path: PosePath) -> None:
        """One path more, which must begin where the last one ended."""
        self._waiting.append(path)

    def work(self) -> Leg | Trip | None:
        """One slice; a path when it was the last one of it, or a reason to stop."""
        if self._current is None:
            if not self._waiting:
                return None
            self._current = self._vetted(self._waiting.popleft())
        try:
            next(self._current)
        except StopIteration as end:
            self._current = None
            return end.value
        except (MotionRejected, ValueError, TypeError, AttributeError) as err:
            return Trip("order", f"an order was refused: {err}")
        return None

    def _vetted(self, path: PosePath) -> Generator[None, None, Leg]:
        joints = yield from path_checks(path, self._rig, self._tool, joints=self._joints)
        base = cup_frame(self._rig.cup).to_base(path.pose)
        away = float(np.linalg.norm(base[0, :3] - self._end[:3]))
        turn = turn_between(base[0, 3:], self._end[3:])
        if away > START_ERROR or turn > START_TURN:
            raise MotionRejected(
                f"it starts {1e3 * away:.3f} mm, {turn:.5f} rad from the last set-point",
                where="path at 0.000 s",
                fix="begin where the arm is",
            )
        self._end, self._joints = base[-1], joints
        leg = Leg(self._count, path, base)
        self._count += 1
        return leg


class Outlet:
    """Hands batches on while the pipe takes them, and keeps the rest.

    Attributes:
        gone: Whether the recorder has closed its end.
    """

    def __init__(self, samples: Connection):
        self._samples = samples
        self._waiting: deque[Sample] = deque()
        self.gone = False

    @property
    def waiting(self) -> int:
        """Samples that the recorder has not taken."""
        return len(self._waiting)

    def put(self, sample: Sample) -> None:
        """Take a sample; every few of them go on."""
        self._waiting.append(sample)
        if len(self._waiting) >= SAMPLES_PER_MESSAGE:
            self.flush()

    def flush(self) -> None:
        """Hand on what the pipe takes without waiting."""
        while self._waiting and not self.gone:
            if not select.select([], [self._samples], [], 0.0)[1]:
                return
            count = min(MAX_SAMPLES_AT_ONCE, len(self._waiting))
            batch = [self._waiting.popleft() for _ in range(count)]
            try:
                self._samples.send(batch)
            except OSError:
                self.gone = True
