"""Universal Robots' arms through ur_rtde: the only file that knows that library.

What it guards against, found in ur_rtde 1.6.5: getters repeat the last value for ever when a link
is lost; `servoL` says True on a dead link; the control interface reconnects by itself, again and
again, starts its script anew without a watchdog, and may crash the process. So a connection that
was once seen lost stays lost here, and nothing is sent after it; the interface that moves the arm
is one that never uploads a script, so that the one which the watchdog guards is the only one; and
a process of its own owns the object.
"""

import sys
from threading import Thread
from typing import Any, NamedTuple

import numpy as np

from ..arm import (
    LOOKAHEAD,
    WATCHDOG_PERIOD,
    ArmReader,
    ArmState,
    LinkLost,
    PathFollower,
    Payload,
    Six,
    Tool,
)
from ..errors import RigError, missing_extra
from ..rig import Rig
from ..safety.limits import TargetCheck

SERVO_GAIN = 300.0  # 1/s2; like LOOKAHEAD the default of the vendor's manual
STOP_DECELERATION = 3.0  # m/s2: from 0.15 m/s at rest within 0.05 s
PROGRAM_ENDS = 1.0  # s, until the controller's program has ended
# ur_rtde checks these two of servoL's arguments and the controller ignores them
UNUSED_SPEED, UNUSED_ACCELERATION = 0.5, 0.5
RTDE_FIELDS = [
    "timestamp",
    "actual_q",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "robot_mode",
    "speed_scaling",
    "target_speed_fraction",
    "runtime_state",
    "safety_status_bits",
    "payload",
    "payload_cog",
]
_READS = 3  # tries to read all fields of one package


class URReader(ArmReader):
    """Reads the state of an arm; has no connection over which it could move it."""

    def __init__(self, address: str, rate: float):
        self._address = address
        self._rate = rate
        self._receive: Any = None
        self._lost = False

    def connect(self) -> None:
        """Open the connection.

        Raises:
            ImportError: ur-rtde is not installed; the message says how to get it.
            RigError: There is no controller at the address, or it refuses.
        """
        receive = _interface("rtde_receive").RTDEReceiveInterface
        self._receive = self._opened(receive, self._address, self._rate, RTDE_FIELDS)

    def read(self) -> ArmState:
        """The latest state, all of it from one package; never waits."""
        state = self._read_once()
        for _ in range(_READS):
            if self.time() == state.time:
                break
            state = self._read_once()
        return state

    def time(self) -> float:
        return self._receive.getTimestamp()

    def payload(self) -> Payload:
        return Payload(self._receive.getPayload(), tuple(self._receive.getPayloadCog()))

    def close(self) -> None:
        """Let the connection go; harmless when repeated.

        An arm's controlling connection is left open: once a link was lost, ur_rtde's clean-up of
        it can hang.
        """
        if self._receive is not None:
            self._receive.disconnect()
            self._receive = None

    def _read_once(self) -> ArmState:
        receive = self._receive
        return ArmState(
            time=self.time(),
            pose=tuple(receive.getActualTCPPose()),
            velocity=tuple(receive.getActualTCPSpeed()),
            wrench=tuple(receive.getActualTCPForce()),
            joints=tuple(receive.getActualQ()),
            robot_mode=receive.getRobotMode(),
            runtime_state=receive.getRuntimeState(),
            safety_bits=receive.getSafetyStatusBits(),
            speed_scaling=receive.getSpeedScaling(),
            speed_slider=receive.getTargetSpeedFraction(),
            connected=self._connected(),
        )

    def _connected(self) -> bool:
        # it stays lost: the library's own reconnection must not look like health
        self._lost = self._lost or not self._receive.isConnected()
        return not self._lost

    def _opened(self, interface: Any, *args: Any) -> Any:
        try:
            return interface(*args)
        except (RuntimeError, ValueError) as err:
            raise RigError(
                f"no controller answers ({err})",
                where=f"robot.host = {self._address}",
                fix="switch it on, or check the address",
            ) from err


class URArm(URReader, PathFollower):
    """Moves an arm along set-points; its limits come with it and cannot be left out."""

    def __init__(self, rig: Rig, address: str, tool: Tool):
        super().__init__(address, rig.robot.rate)
        self._robot = rig.robot
        self._tcp: Six = getattr(rig.robot, f"{tool}_tcp")
        self._check = TargetCheck(rig, tool)
        self._control: Any = None
        self._previous: np.ndarray | None = None
        self._braking: Thread | None = None

    def take_control(self) -> None:
        """Upload ur_rtde's control script, set the tool's centre and the payload.

        Raises:
            ImportError: ur-rtde is not installed; the message says how to get it.
            RigError: The controller refuses.
            LinkLost: It did not take the tool's centre or the payload. The script may be left
                running, and moves nothing: `give_up` ends it.
        """
        control = _interface("rtde_control").RTDEControlInterface
        starter = self._opened(control, self._address, self._rate, control.FLAG_UPLOAD_SCRIPT)
        del starter  # which disconnects: input registers have one owner
        # what it finds running it never starts again, whenever it reconnects
        self._control = self._opened(control, self._address, self._rate, control.FLAG_NO_WAIT)
        if not self._control.setTcp(list(self._tcp)):
            raise LinkLost("the controller did not take the tool's centre")
        if not self._control.setPayload(self._robot.payload, list(self._robot.payload_centre)):
            raise LinkLost("the controller did not take the payload")

    def tcp(self) -> Six:
        x, y, z, rx, ry, rz = self._control.getTCPOffset()
        return x, y, z, rx, ry, rz

    def allows(self, pose: np.ndarray) -> bool:
        return bool(self._control.isPoseWithinSafetyLimits(list(pose)))

    def arm_watchdog(self) -> None:
        """Make the controller end its program 0.1 s after the last set-point.

        An upload would disarm it; none follows.

        Raises:
            LinkLost: The controller did not take it.
        """
        if not self._control.setWatchdog(1.0 / WATCHDOG_PERIOD):
            raise LinkLost("the controller did not take the watchdog")

    def command(self, pose: np.ndarray) -> None:
        """Send a set-point; it also keeps the watchdog quiet, and nothing else does.

        Raises:
            MotionRejected: It breaks a limit; nothing was sent.
            LinkLost: The connection is lost, the program has ended, or `stop` was called.
        """
        if self._previous is None:
            self._previous = np.array(self.read().pose)
        self._check(self._previous, pose)
        if self._braking is not None:
            raise LinkLost("the arm was stopped; nothing is sent to its controller any more")
        if not self._connected():
            raise LinkLost("the connection to the controller is lost; nothing is sent any more")
        period = 1.0 / self._rate
        sent = self._control.servoL(
            pose.tolist(), UNUSED_SPEED, UNUSED_ACCELERATION, period, LOOKAHEAD, SERVO_GAIN
        )
        if not sent:
            raise LinkLost("the controller's program does not take set-points any more")
        self._previous = pose

    def stop(self) -> None:
        """Bring the arm to rest; returns at once, since waiting for the answer may be for ever.

        On a lost connection nothing is sent: the watchdog ends the program, while a command would
        make the library reconnect.
        """
        if self._braking is None:
            self._braking = Thread(target=self._brake, name="brake", daemon=True)
            self._braking.start()

    def give_up(self) -> None:
        self.stop()
        assert self._braking is not None
        self._braking.join(PROGRAM_ENDS)

    def _brake(self) -> None:
        # stopL(asynchronous) would leave the script's servo thread in charge of the arm
        if self._control is not None and self._connected():
            self._control.servoStop(STOP_DECELERATION)
        if self._control is not None and self._connected():
            self._control.stopScript()

    def _connected(self) -> bool:
        if self._control is not None:
            self._lost = self._lost or not self._control.isConnected()
        return super()._connected()


class URController(NamedTuple):
    """The controller of a Universal Robots' arm, by its network address."""

    address: str

    def reader(self, rig: Rig) -> URReader:
        """The arm to look at, not connected yet."""
        return URReader(self.address, rig.robot.rate)

    def follower(self, rig: Rig, tool: Tool) -> URArm:
        """The arm to command with a tool in its gripper, not connected yet."""
        return URArm(rig, self.address, tool)


def _interface(module: str) -> Any:
    try:
        return __import__(module)
    except ImportError as err:
        if sys.version_info >= (3, 13):
            raise ImportError(
                "the robot needs ur-rtde, which has no wheel for Python 3.13; "
                "use Python 3.12 and: pip install 'bolfi-liquids[robot]'"
            ) from err
        raise missing_extra("ur-rtde", "robot", "the robot") from err
