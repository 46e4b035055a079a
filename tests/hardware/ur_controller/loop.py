"""The emulator's event loop: sockets between ticks at absolute times."""

import sys
from collections.abc import Callable

from bolfi_liquids.hardware.emulated.arm import MAX_LATENESS
from bolfi_liquids.hardware.process import REAL_CLOCK, HostClock

from .admin import AdminSession, Faults
from .controller import Controller, Options
from .dashboard import DashboardSession
from .network import ADMIN, DASHBOARD, RTDE, SCRIPT, Network
from .rtde import RtdeSession
from .script_port import ScriptSession


class ControllerServer:
    """A controller with its four ports open.

    Attributes:
        controller: Behind the ports.
        network: The ports.
        faults: Of the link, as the admin port injects them.

    Raises:
        RigError: The address is not one of 127.0.0.0/8, or a port is taken.
    """

    def __init__(self, address: str, options: Options, clock: HostClock = REAL_CLOCK):
        self.controller = Controller(options, clock)
        self._clock = clock
        self.faults = Faults()
        self.network = Network(
            address,
            {
                RTDE: lambda one: RtdeSession(one, self.controller, self._rtde),
                SCRIPT: lambda one: ScriptSession(one, self.controller),
                DASHBOARD: lambda one: DashboardSession(one, self.controller),
                ADMIN: lambda one: AdminSession(one, self.controller, self.faults),
            },
            clock,
        )
        self.faults.network = self.network

    def run(self, wanted: Callable[[], bool]) -> None:
        """Serve while `wanted()`, which is asked every tick."""
        deadline = self._clock.now()
        while wanted():
            deadline += self.controller.dt
            while (left := deadline - self._clock.now()) > 0.0:
                self.network.poll(left)
            deadline = self.turn(deadline)

    def turn(self, deadline: float) -> float:
        """One tick, which was due at `deadline` [s]; that, or later if ticks were left out."""
        # what came while this process had no time counts before the tick
        self.network.poll(0.0)
        self._tick()
        late = self._clock.now() - deadline
        if late <= MAX_LATENESS:
            return deadline
        ticks = int(late / self.controller.dt)
        self.controller.skip(ticks)
        print(f"emulator: {ticks} ticks late, left out", file=sys.stderr, flush=True)
        return deadline + ticks * self.controller.dt

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
                session.publish(snapshot, self.faults.late)
        for session in self.network.sessions(ADMIN):
            if isinstance(session, AdminSession):
                session.publish(snapshot)
        self.network.watch_unsent()
