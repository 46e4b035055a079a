"""The emulator's event loop: sockets between ticks at absolute times."""

import sys
import time
from collections.abc import Callable

from .controller import Controller, Options
from .servers.admin import AdminSession, Faults
from .servers.dashboard import DashboardSession
from .servers.network import ADMIN, DASHBOARD, RTDE, SCRIPT, Network
from .servers.rtde import RtdeSession
from .servers.script import ScriptSession

LATE = 0.05  # s; ticks that are later are left out, not made up for


class Emulator:
    """A controller with its four ports open.

    Raises:
        RigError: The address is not one of 127.0.0.0/8, or a port is taken.
    """

    def __init__(self, address: str, options: Options):
        self.controller = Controller(options)
        self._faults = Faults()
        self.network = Network(
            address,
            {
                RTDE: lambda one: RtdeSession(one, self.controller, self._rtde),
                SCRIPT: lambda one: ScriptSession(one, self.controller),
                DASHBOARD: lambda one: DashboardSession(one, self.controller),
                ADMIN: lambda one: AdminSession(one, self.controller, self._faults),
            },
        )
        self._faults.network = self.network

    def run(self, wanted: Callable[[], bool]) -> None:
        """Serve while `wanted()`, which is asked every tick."""
        deadline = time.monotonic()
        dt = self.controller.dt
        while wanted():
            deadline += dt
            while (left := deadline - time.monotonic()) > 0.0:
                self.network.poll(left)
            # what came while this process had no time counts before the tick
            self.network.poll(0.0)
            self._tick()
            late = time.monotonic() - deadline
            if late > LATE:
                ticks = int(late / dt)
                self.controller.skip(ticks)
                deadline += ticks * dt
                print(f"emulator: {ticks} ticks late, left out", file=sys.stderr, flush=True)

    def close(self) -> None:
        self.network.close()

    def _rtde(self) -> list[RtdeSession]:
        return [one for one in self.network.sessions(RTDE) if isinstance(one, RtdeSession)]

    def _tick(self) -> None:
        snapshot = self.controller.tick()
        frozen = self.network.frozen
        for session in self._rtde():
            if frozen:
                session.miss()
            else:
                session.publish(snapshot, self._faults.late)
        for session in self.network.sessions(ADMIN):
            if isinstance(session, AdminSession):
                session.publish(snapshot)
        self.network.watch_unsent()
