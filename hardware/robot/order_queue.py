"""Orders on their way into the motion loop, which never waits for them."""

from collections import deque
from collections.abc import Generator
from multiprocessing.connection import Connection
from threading import Thread

import numpy as np

from ..errors import MotionRejected
from ..motion.cup_frame import cup_frame
from ..motion.stir_paths import PosePath
from ..priority import hurry
from ..rig import Rig
from ..safety.guards import Trip
from ..safety.limits import Tool, path_checks, turn_between
from .orders import Ask, Follow, Leave, Stop
from .path_queue import Leg

# of a path's first pose from the last set-point: paths join, but for rounding
START_ERROR = 1e-6  # m
START_TURN = 1e-5  # rad


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
