"""A controller as a child process, and the client of what no real controller offers."""

import json
import os
import random
import select
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from bolfi_liquids.hardware.motion.kinematics import inverse
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.safety.limits import Tool, workspace

from .server import ADMIN, PORTS

START_TIMEOUT = 20.0  # s
FOLDER = str(Path(__file__).parents[1])  # in which Python finds this package


class Admin:
    """Looks behind the emulated controller and injects faults; each call has its own connection.

    Args:
        address: Of the emulator.
    """

    def __init__(self, address: str):
        self._address = address

    def state(self) -> SimpleNamespace:
        """Of the emulator at its latest tick: a `Snapshot`, why it stopped, and its motions."""
        return self._ask("state")

    def stream(self) -> Iterator[SimpleNamespace]:
        """The state of every tick; ends when the emulator does. Close the iterator after use."""
        yield from self._told("stream")

    def force(self, wrench: Sequence[float]) -> None:
        """Press with this force [N] and torque [Nm] at the TCP until the next call."""
        self._ask("force", [float(value) for value in wrench])

    def protective_stop(self) -> None:
        self._ask("protective_stop")

    def freeze(self, seconds: float) -> None:
        """The robot's ports stand still for a while; the arm and its watchdog go on."""
        self._ask("freeze", seconds)

    def drop(self) -> None:
        """Close all connections to the robot's ports."""
        self._ask("drop")

    def motions(self) -> int:
        """How often the arm began to move since the start."""
        return self._ask("state").started

    def _ask(self, *request: object) -> SimpleNamespace:
        with closing(self._told(*request)) as told:
            return next(told)

    def _told(self, *request: object) -> Iterator[SimpleNamespace]:
        address = (self._address, ADMIN)
        with socket.create_connection(address, 5.0) as link, link.makefile("rw") as lines:
            lines.write(json.dumps(request) + "\n")
            lines.flush()
            for line in lines:
                yield SimpleNamespace(**json.loads(line))


class ControllerProcess:
    """A running emulator; closes it at the end of a `with` block.

    The child ends by itself when this process ends, however that may happen.

    Attributes:
        address: Where it listens.
        admin: Client of its admin port.
    """

    def __init__(self, **options: object):
        """Start one and wait until it listens; `options` are fields of `Options`.

        Raises:
            RuntimeError: It did not start; the message holds what it said.
        """
        self.address = free_address()
        self.admin = Admin(self.address)
        # appending: reading here must not move the place where the child writes
        self._notes = tempfile.TemporaryFile("a+b")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "ur_controller", self.address, json.dumps(options)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._notes,
            text=True,
            env=os.environ | {"PYTHONPATH": FOLDER},
            # Ctrl-C is for the parent, which may still have to stop the arm
            start_new_session=True,
        )
        output = self._process.stdout
        if not (select.select([output], [], [], START_TIMEOUT)[0] and output.readline()):
            said = self.notes()
            self.close()
            raise RuntimeError(f"the emulator did not start; it said: {said or 'nothing'}")

    @classmethod
    def at_pose(cls, rig: Rig, pose: np.ndarray, tool: Tool = "stirring") -> "ControllerProcess":
        """Start the controller of a rig's robot.

        Args:
            rig: Its robot.
            pose: Of the tool's centre, at rest: position in the cup's frame [m], rotation vector in
                the base frame [rad], shape (6,).
            tool: Whose centre its installation has.
        """
        space = workspace(rig, tool)
        base = cup_frame(rig.cup).to_base(pose)
        joints = inverse(space.arm, base, space.start, tcp=space.tcp)
        tcp = space.tcp.tolist()
        return cls(controller=rig.robot.controller, joints=joints.tolist(), tcp=tcp)

    def notes(self) -> str:
        """What the emulator has written so far: why programs stopped, ticks left out."""
        if self._notes.closed:
            return ""
        self._notes.seek(0)
        return self._notes.read().decode("utf-8", "replace")

    def close(self) -> None:
        """End it; harmless when repeated."""
        self._process.stdin.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()
        self._notes.close()

    def __enter__(self) -> "ControllerProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def free_address() -> str:
    """An address on which none of the emulator's ports is taken just now."""
    # the system's own source: seeding `random` must not make two processes collide
    source = random.SystemRandom()
    while True:
        address = ".".join(["127", *(str(source.randint(1, 254)) for _ in range(3))])
        with socket.socket() as sock:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                sock.bind((address, min(PORTS)))
            except OSError:
                continue
        return address
