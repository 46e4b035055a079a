"""Motions of the arm while it pours: the tool's centre is the lip of the source cup.

The source comes from above, turns about its lip at a constant angular velocity, holds, turns back
upright and leaves upwards, as in "To Stir or Not to Stir" (angular velocity and distance decide).
"""

import numpy as np

from ..rig import Rig
from .patterns import check_positive
from .poses import cup_frame
from .stir_paths import PosePath, placed, profile, travel, turn_rate, up_and_over

RAMP_SECONDS = 0.1  # s, in which the turn reaches its angular velocity, and in which it ends
UPRIGHT_RATE = np.radians(60.0)  # rad/s, of the turn back
UPRIGHT_ACCELERATION = np.radians(240.0)  # rad/s2


def ready_to_pour(rig: Rig, distance: float, lip_height: float) -> np.ndarray:
    """The lip above the place of the pour, the source upright: where `pour_path` begins.

    Args:
        rig: Where the receiver stands.
        distance: Horizontal, from the lip to the receiver's axis [m].
        lip_height: Of the lip above the receiver's floor while it pours [m].

    Returns:
        Position in the cup's frame [m] and rotation vector [rad], shape (6,).
    """
    plan = rig.pouring
    lip = np.array(plan.receiver) - distance * _heading(rig)
    lip[2] += lip_height + plan.approach_height
    return cup_frame(rig.cup).from_base(np.array([*lip, *rig.robot.pouring_orientation]))


def approach_pour(rig: Rig, pose: np.ndarray, *, distance: float, lip_height: float) -> PosePath:
    """Path of the lip to `ready_to_pour`: straight up, then sideways, then down.

    Args:
        rig: What is known of the place.
        pose: The lip now, position in the cup's frame, shape (6,).
        distance: Horizontal, from the lip to the receiver's axis [m].
        lip_height: Of the lip above the receiver's floor while it pours [m].
    """
    target = ready_to_pour(rig, distance, lip_height)
    return up_and_over(rig, pose, target, rig.pouring.approach_speed)


def pour_path(
    rig: Rig,
    *,
    angular_velocity: float,
    distance: float,
    lip_height: float,
    final_angle: float,
    hold: float,
) -> PosePath:
    """Down from `ready_to_pour`, the pour about the resting lip, back upright, and up again.

    The turn reaches its angular velocity within `RAMP_SECONDS` and gives it up within the same; in
    between it is constant. A turn too short for that never reaches it.

    Args:
        rig: Where the receiver stands, and in which direction the liquid leaves.
        angular_velocity: Of the source about its lip [rad/s].
        distance: Horizontal, from the lip to the receiver's axis [m].
        lip_height: Of the lip above the receiver's floor [m].
        final_angle: From upright, at which the source stays [rad].
        hold: Time at the final angle [s].

    Raises:
        ValueError: a number is not finite, or the angular velocity or the angle not positive.
    """
    check_positive(angular_velocity=angular_velocity, final_angle=final_angle)
    if not np.isfinite((distance, lip_height, hold)).all() or hold < 0:
        raise ValueError(
            f"distance, lip_height and hold must be finite, got {distance, lip_height, hold}"
        )
    ready = ready_to_pour(rig, distance, lip_height)
    low = placed(ready, z=ready[2] - rig.pouring.approach_height)
    dt = 1.0 / rig.robot.rate
    down = travel(rig, [ready, low], rig.pouring.approach_speed).pose
    over = profile(final_angle, angular_velocity, angular_velocity / RAMP_SECONDS)
    back = profile(final_angle, turn_rate(rig, UPRIGHT_RATE), UPRIGHT_ACCELERATION)
    angle = np.concatenate(
        [
            over.travelled(_samples(over.duration, dt)),
            np.full(round(hold / dt), final_angle),
            final_angle - back.travelled(_samples(back.duration, dt)),
        ]
    )
    turned = _tilted(low, np.cross([0.0, 0.0, 1.0], _heading(rig)), angle)
    pose = np.concatenate([down, turned, down[::-1]])
    return PosePath(dt * np.arange(len(pose)), pose, False)


def upright_again(rig: Rig, path: PosePath, at: float) -> PosePath:
    """The tool turned back from where it is in a path to how it was held at the path's start.

    For a pour that is given up: the lip stays, the source turns by the shorter way, which for an
    angle below 180 degrees is the way it came.

    Args:
        rig: Gives the greatest rate of turning.
        path: What is given up.
        at: Time since its start [s].
    """
    from scipy.spatial.transform import Rotation

    dt = float(path.time[1] - path.time[0])
    here = path.pose[min(int(at / dt), len(path.pose) - 1)]
    first, now = Rotation.from_rotvec(path.pose[0, 3:]), Rotation.from_rotvec(here[3:])
    turn = (first * now.inv()).as_rotvec()
    angle = float(np.linalg.norm(turn))
    way = profile(angle, turn_rate(rig, UPRIGHT_RATE), UPRIGHT_ACCELERATION)
    if angle < 1e-9:
        return PosePath(dt * np.arange(2), np.stack([here, here]), False)
    pose = _tilted(here, turn / angle, way.travelled(_samples(way.duration, dt)))
    return PosePath(dt * np.arange(len(pose)), pose, False)


def _heading(rig: Rig) -> np.ndarray:
    angle = np.radians(rig.pouring.heading_deg)
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def _samples(duration: float, dt: float) -> np.ndarray:
    return dt * np.arange(int(np.ceil(duration / dt)) + 1)


def _tilted(pose: np.ndarray, axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """A pose turned about its own position by angles [rad], shape (T, 6)."""
    from scipy.spatial.transform import Rotation

    turned = Rotation.from_rotvec(angle[:, None] * axis) * Rotation.from_rotvec(pose[3:])
    return np.column_stack([np.tile(pose[:3], (len(angle), 1)), turned.as_rotvec()])
