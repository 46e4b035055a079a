"""What ur_rtde's control script does for each number in its command register."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from bolfi_liquids.hardware.emulated.arm import SERVO_RATE
from bolfi_liquids.hardware.emulated.motion import JointState, Motion, joint_speed, servo, twist
from bolfi_liquids.hardware.motion.kinematics import DhArm, forward, inverse
from bolfi_liquids.hardware.motion.poses import compose

from .moves import Plan, Timed, joint_move, line
from .queued_arm import QueuedArm
from .script import Kind, Waypoint

if TYPE_CHECKING:
    from .program import Program

Command = Callable[["Program"], None]

BRAKE_DECELERATION = 3.0  # rad/s2; of a motion whose thread was killed
_ZERO = np.zeros(6)

# carried out again whenever the script reads them, and answered at once
REALTIME_COMMANDS = frozenset({6, 9, 10, 11, 24, 25, 26, 27, 38, 58, *range(66, 72)})


class ProgramError(Exception):
    """The script fails, as it would on the controller: it ends, and the arm stops."""


def within_limits(arm: QueuedArm, pose: np.ndarray) -> bool:
    """Whether the arm reaches a pose at all; the installation's planes are not emulated."""
    return (
        inverse(arm.mounted.arm, pose, arm.state.joints, tcp=arm.mounted.tcp).status
        != "unreachable"
    )


def _plan(arm: QueuedArm, waypoint: Waypoint) -> Plan:
    target = np.array(waypoint.target)

    def plan(state: JointState) -> Motion | Timed:
        profile = (waypoint.speed, waypoint.acceleration)
        if waypoint.kind == "movej":
            joints = arm.mounted.joints(target, state.joints) if waypoint.is_pose else target
            return joint_move(arm.mounted.arm, state.joints, joints, *profile)
        pose = target if waypoint.is_pose else arm.mounted.pose(target)
        return line(arm.mounted, state.joints, pose, *profile)

    return plan


def _move(kind: Kind, *, is_pose: bool) -> Command:
    def run(program: "Program") -> None:
        *target, speed, acceleration = program.numbers(0, 8)
        waypoint = Waypoint(kind, is_pose, tuple(target), speed, acceleration, None)
        program.end_move()
        thread = "move" if program.integer(1) == 1 else None
        program.begin([_plan(program.arm, waypoint)], thread, brake=BRAKE_DECELERATION)

    return run


def _move_path(program: "Program") -> None:
    path = program.script.path
    program.end_move()
    thread = "move" if program.integer(1) == 1 else None
    program.begin(
        [_plan(program.arm, one) for one in path], thread, brake=BRAKE_DECELERATION, path=path
    )


def _fresh(program: "Program", count: int) -> list[float] | None:
    """Numbers of a real-time command, or None while they stay what they were."""
    numbers = program.numbers(0, count)
    latest = (program.integer(0), *numbers)
    if program.latest == latest:
        return None
    program.latest = latest
    return numbers


def _servo(*, is_pose: bool) -> Command:
    def run(program: "Program") -> None:
        numbers = _fresh(program, 11)
        if numbers is None:
            return
        target, lookahead, gain = np.array(numbers[:6]), numbers[9], numbers[10]
        arm = program.arm
        if is_pose:
            target = arm.mounted.joints(target, arm.state.joints)
        motion = servo(arm.mounted.arm, target, lookahead, gain, SERVO_RATE)
        program.begin([lambda _: motion], "servo")

    return run


def _speed(*, linear: bool) -> Command:
    def run(program: "Program") -> None:
        numbers = _fresh(program, 7)
        if numbers is None:
            return
        target, rate, arm = np.array(numbers[:6]), numbers[6], program.arm.mounted
        motion = twist(arm, target, rate) if linear else joint_speed(target, rate)
        program.begin([lambda _: motion], "speed")
        program.speeds_are_linear = linear

    return run


def _stop_plan(program: "Program", rate: float, *, linear: bool) -> Plan:
    mounted = program.arm.mounted
    if linear:
        return lambda _: twist(mounted, _ZERO, rate, ends=True)
    return lambda _: joint_speed(_ZERO, rate, ends=True)


def _speed_stop(program: "Program") -> None:
    program.end_thread("speed")
    plan = _stop_plan(program, program.number(0), linear=program.speeds_are_linear)
    program.begin([plan], None)


def _servo_stop(program: "Program") -> None:
    program.end_thread("servo")
    program.begin([_stop_plan(program, program.number(0), linear=True)], None)


def _stop(program: "Program") -> None:
    """stopL and stopJ alike: whether the stop is linear depends on whether one was asynchronous."""
    if program.thread == "stop":
        program.end_thread("stop")
        program.report(-1)
    else:
        program.end_move()
    asynchronous = program.integer(1) == 1
    if asynchronous:
        program.linear_stop = True
    plan = _stop_plan(program, program.number(0), linear=program.linear_stop)
    program.begin([plan], "stop" if asynchronous else None)


def _inverse(program: "Program", near: np.ndarray | None = None) -> np.ndarray:
    pose, arm = np.array(program.numbers(0)), program.arm
    start = arm.state.joints if near is None else near
    found = inverse(arm.mounted.arm, pose, start, tcp=arm.mounted.tcp)
    if found.status == "unreachable":
        raise ProgramError(f"no joints for pose {np.round(pose, 4).tolist()}")
    return found.joints


def _has_inverse(program: "Program") -> None:
    program.give_integer(within_limits(program.arm, np.array(program.numbers(0))))


def _joints_within(program: "Program") -> None:
    joints = np.array(program.numbers(0))
    program.give_integer(bool((np.abs(joints) <= program.arm.mounted.arm.joint_limit).all()))


def _forward(program: "Program") -> None:
    model: DhArm = program.arm.mounted.arm
    program.give(forward(model, program.numbers(0), tcp=program.numbers(6)))


def _set_tcp(program: "Program") -> None:
    offset = np.array(program.numbers(0))
    if not np.isfinite(offset).all():
        raise ProgramError(f"TCP offset {offset.tolist()} is not finite")
    program.arm.mount(offset)


def _set_payload(program: "Program") -> None:
    mass, *centre = program.numbers(0, 4)
    program.machine.set_payload(mass, tuple(centre))


def _on_e_series(run: Command) -> Command:
    """ur_rtde strikes these lines from the script for older controllers: nothing happens there."""

    def guarded(program: "Program") -> None:
        if program.machine.version >= (5, 4):
            run(program)

    return guarded


COMMANDS: dict[int, Command] = {
    1: _move("movej", is_pose=False),
    2: _move("movej", is_pose=True),
    3: _move("movel", is_pose=True),
    4: _move("movel", is_pose=False),
    8: lambda p: p.machine.zero_force(),
    9: _speed(linear=False),
    10: _speed(linear=True),
    11: _servo(is_pose=False),
    15: _speed_stop,
    16: _servo_stop,
    17: _set_payload,
    20: lambda _: None,
    21: lambda _: None,
    24: _servo(is_pose=True),
    25: _on_e_series(lambda p: p.give_integer(0)),
    26: _on_e_series(lambda p: p.give([p.machine.dt])),
    29: _set_tcp,
    30: lambda p: p.give(_inverse(p, np.array(p.numbers(6)))),
    31: lambda p: p.machine.protective_stop("asked for by the script"),
    33: _stop,
    34: _stop,
    35: lambda p: p.machine.set_watchdog(p.number(0), p.script.offset),
    36: _has_inverse,
    37: _joints_within,
    38: lambda p: p.give(_ZERO),
    39: lambda p: p.give(compose(p.numbers(0), p.numbers(6))),
    40: lambda p: p.give(p.arm.mounted.tcp),
    43: lambda p: p.give(p.arm.pose),
    44: _forward,
    45: _move_path,
    46: lambda p: p.give(_inverse(p)),
    47: lambda p: p.give_integer(p.machine.steady),
    58: lambda p: p.give(forward(p.arm.mounted.arm, p.arm.state.joints)),
    59: lambda _: None,
    60: _has_inverse,
    61: _has_inverse,
    65: _set_payload,
}
