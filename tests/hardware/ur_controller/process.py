"""A controller as a child process."""

import json
import os
import random
import select
import socket
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.motion.kinematics import inverse
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.safety.limits import Tool, workspace

from .admin_client import Admin
from .network import ADMIN, DASHBOARD, RTDE, SCRIPT

START_TIMEOUT = 20.0  # s
FOLDER = str(Path(__file__).parents[1])  # in which Python finds this package
ADDRESS_TRIES = 20  # random addresses of which one must be free


class ControllerProcess:
    """A running emulator; closes it at the end of a `with` block.

    The child ends by itself when this process ends, however that may happen.

    Attributes:
        address: Where it listens.
        admin: Client of its admin port.
    """

    def __init__(self, command: Sequence[str], address: str):
        self.address = address
        self.admin = Admin(address)
        # appending: reading here must not move the place where the child writes
        self._notes = tempfile.TemporaryFile("a+b")
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._notes,
            text=True,
            env=os.environ | {"PYTHONPATH": FOLDER},
            # Ctrl-C is for the parent, which may still have to stop the arm
            start_new_session=True,
        )

    @classmethod
    def start(
        cls,
        address: str | None = None,
        *,
        controller: str = "cb3",
        joints: Sequence[float] | None = None,
        options: Mapping[str, object] | None = None,
    ) -> "ControllerProcess":
        """Start one and wait until it listens.

        Args:
            address: One of 127.0.0.0/8; None takes one at random that is free.
            controller: "cb3" or "e-series".
            joints: At the start [rad], shape [6].
            options: Further options of its command line, such as {"seed": 1, "unlock-after": 0}.

        Raises:
            RigError: It did not start; the message holds what it said.
        """
        address = free_address() if address is None else address
        command = [sys.executable, "-m", "ur_controller", "--while-stdin", f"--address={address}"]
        command.append(f"--controller={controller}")
        if joints is not None:
            command.append(f"--joints={json.dumps([float(value) for value in joints])}")
        command += [f"--{name}={value}" for name, value in (options or {}).items()]
        started = cls(command, address)
        started._wait_until_ready()
        return started

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
        return cls.start(
            controller=rig.robot.controller,
            joints=inverse(space.arm, base, space.start, tcp=space.tcp),
            options={"tcp": json.dumps(space.tcp.tolist())},
        )

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None

    def notes(self) -> str:
        """What the emulator has written so far: why programs stopped, ticks left out."""
        if self._notes.closed:
            return ""
        self._notes.seek(0)
        return self._notes.read().decode("utf-8", "replace")

    def close(self) -> None:
        """End it; harmless when repeated."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._notes.close()

    def __enter__(self) -> "ControllerProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _wait_until_ready(self) -> None:
        line, output = "", self._process.stdout
        if output is not None and select.select([output], [], [], START_TIMEOUT)[0]:
            line = output.readline()
        if not line.startswith("ready"):
            said = self.notes().strip().replace("\n", " | ")
            self.close()
            raise RigError(
                f"the emulator did not start; it said: {said or 'nothing'}",
                where=f"address {self.address}",
                fix="mend what it names, or start it by hand",
            )


def free_address() -> str:
    """An address on which none of the emulator's ports is taken just now."""
    # the system's own source: seeding `random` must not make two processes collide
    source = random.SystemRandom()
    for _ in range(ADDRESS_TRIES):
        address = ".".join(["127", *(str(source.randint(1, 254)) for _ in range(3))])
        if all(_is_free(address, port) for port in (RTDE, SCRIPT, DASHBOARD, ADMIN)):
            return address
    raise RigError(
        f"no free address in 127.0.0.0/8 after {ADDRESS_TRIES} tries",
        where="starting an emulator",
        fix="give one with address=",
    )


def _is_free(address: str, port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            sock.bind((address, port))
        except OSError:
            return False
    return True
