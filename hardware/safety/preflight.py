"""Conditions of a motion (S3), as a list that a person can read."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..arm import ArmState, Payload, Six
from ..board import Row, Who
from ..motion.kinematics import forward
from ..motion.poses import cup_frame
from ..rig import Rig
from .guards import CAMERAS, FULL_SPEED, RECORDER_AGE, RUNNING_MODE, safe, safety_text
from .limits import Tool, turn_between, workspace

# a real arm's calibrated kinematics differ from the published ones by up to some millimetres
KINEMATICS_ERROR = 0.008  # m
KINEMATICS_TURN = float(np.radians(2.0))
TCP_ERROR = 1e-4  # m and rad
PAYLOAD_ERROR = 0.01  # kg
CENTRE_ERROR = 1e-3  # m
FORCE_SPREAD = 0.25  # of the force's limit, while the arm rests
RESTING_SPEED = 1e-3  # m/s
LEAST_DISK = 200e6  # bytes
NO_SIGN = "no sign of life; bolfi-liquids rig check tells why"


class Check(NamedTuple):
    """One line of the list: what, whether it is well, and the numbers."""

    name: str
    ok: bool
    text: str


def arm_checks(states: list[ArmState], rig: Rig) -> list[Check]:
    """Checks by a look at the arm, armed or not.

    Args:
        states: Read one after the other for some tenths of a second, the arm at rest.
        rig: What should be.
    """
    state, limits = states[-1], rig.limits
    return [
        Check("connection", state.connected, "all connections are open"),
        Check(
            "clock",
            state.time > states[0].time,
            f"the controller's clock went on by {state.time - states[0].time:.3f} s",
        ),
        *controller_checks(state, rig),
        Check(
            "speed slider",
            state.speed_slider >= FULL_SPEED,
            f"{100 * state.speed_slider:.0f} %, must be {100 * FULL_SPEED:.0f} % or more",
        ),
        Check("at rest", state.speed <= RESTING_SPEED, f"{1e3 * state.speed:.2f} mm/s"),
        _force_check(states, limits.force),
    ]


def controller_checks(state: ArmState, rig: Rig) -> list[Check]:
    """Whether the controller is ready to move."""
    return [
        Check("robot mode", state.robot_mode == RUNNING_MODE, f"robot_mode = {state.robot_mode}"),
        Check("safety", safe(state.safety_bits, rig.limits), safety_text(state.safety_bits)),
    ]


def mounted_checks(state: ArmState, tcp: Six | None, rig: Rig, tool: Tool) -> list[Check]:
    """Whether tool and place are what the rig's file says; `tcp` is None if it is not known."""
    return [
        _tcp_check(tcp, workspace(rig, tool).tcp),
        _kinematics_check(state, rig, tool),
        place_check(state, rig, tool),
    ]


def payload_check(payload: Payload, rig: Rig, *, ours: bool = False) -> Check:
    """Whether the controller's payload is that of the rig's file.

    Args:
        payload: As the controller says.
        rig: What should be.
        ours: Whether we have set it. Before that, none means that nobody has, which is well.
    """
    if not payload.mass and not ours:
        said = f"none is set in the controller; --arm sets {rig.robot.payload:.3f} kg"
        return Check("payload", True, said)
    away = abs(payload.mass - rig.robot.payload)
    centre = np.abs(np.subtract(payload.centre, rig.robot.payload_centre)).max()
    return Check(
        "payload",
        bool(away <= PAYLOAD_ERROR and centre <= CENTRE_ERROR),
        f"{payload.mass:.3f} kg at {np.round(payload.centre, 3).tolist()} m, "
        f"the rig's file says {rig.robot.payload:.3f} kg",
    )


def place_check(state: ArmState, rig: Rig, tool: Tool) -> Check:
    """Whether the tool is in its box."""
    space = workspace(rig, tool)
    place = cup_frame(rig.cup).from_base(np.array(state.pose))[:3]
    inside = bool(((place >= space.box.low) & (place <= space.box.high)).all())
    text = f"the tool is at {np.round(place, 3).tolist()} m of the cup's frame"
    return Check("box", inside, text if inside else f"{text}; jog it into limits.{tool}")


def process_checks(rows: Mapping[Who, Row], rig: Rig, now: float) -> list[Check]:
    """Whether the other processes are alive and well."""
    checks = []
    for who, row in rows.items():
        most = rig.limits.frame_age if who in CAMERAS else RECORDER_AGE
        well = row.age(now) <= most and not row.trouble
        text = f"last sign of life {row.age(now):.3f} s ago" if row.beat else NO_SIGN
        checks.append(Check(who.label, well, text))
    return checks


def disk_check(directory: Path) -> Check:
    """Whether the disk has room."""
    free = shutil.disk_usage(directory).free
    text = f"{free / 1e6:.0f} MB free, {LEAST_DISK / 1e6:.0f} MB needed"
    return Check("disk", free >= LEAST_DISK, text)


def failures(checks: list[Check]) -> str:
    """All that is not well, in one line; empty if everything is."""
    return "; ".join(f"{check.name}: {check.text}" for check in checks if not check.ok)


def _force_check(states: list[ArmState], limit: float) -> Check:
    force = np.array([state.wrench[:3] for state in states])
    spread = float(np.linalg.norm(force - force.mean(axis=0), axis=1).max())
    return Check(
        "force at rest",
        spread <= FORCE_SPREAD * limit,
        f"it varies by {spread:.2f} N about {np.linalg.norm(force.mean(axis=0)):.2f} N",
    )


def _tcp_check(set_now: Six | None, tcp: np.ndarray) -> Check:
    if set_now is None:
        return Check("tool's centre", True, "not asked in a dry run")
    away = float(np.abs(np.array(set_now[:3]) - tcp[:3]).max())
    turn = turn_between(np.array(set_now[3:]), tcp[3:])
    well = max(away, turn) <= TCP_ERROR
    return Check("tool's centre", well, f"{1e3 * away:.2f} mm, {turn:.4f} rad from the rig's file")


def _kinematics_check(state: ArmState, rig: Rig, tool: Tool) -> Check:
    space = workspace(rig, tool)
    expected = forward(space.arm, state.joints, tcp=space.tcp)
    away = float(np.linalg.norm(expected[:3] - state.pose[:3]))
    turn = turn_between(expected[3:], np.array(state.pose[3:]))
    well = away <= KINEMATICS_ERROR and turn <= KINEMATICS_TURN
    return Check(
        "kinematics",
        well,
        f"the tool is {1e3 * away:.2f} mm, {np.degrees(turn):.2f} deg from where the joints and "
        "the rig's file put it",
    )
