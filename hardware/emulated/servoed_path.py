"""The way of the emulated arm that follows a path, reckoned beforehand."""

import numpy as np

from ..arm import LOOKAHEAD
from ..motion.stir_paths import PosePath
from ..motion.trajectory import Trajectory
from ..robot.ur import SERVO_GAIN
from .motion import oscillator


def servoed(path: PosePath) -> Trajectory:
    """Where the emulated arm is while it is servoed along a path, in the path's frame.

    It lags by some 0.1 s and rounds corners off by 1 to 2 mm. The servo acts on joints; over a
    cup's width the same filter acts on positions.

    Args:
        path: From rest to rest; an arm that starts it rests at its first pose.

    Returns:
        The path's times [s], and the tool's centre at each [m].
    """
    period = float(path.time[1] - path.time[0])
    stay, push, swing, keep = oscillator(SERVO_GAIN, SERVO_GAIN * LOOKAHEAD, period)
    targets = path.pose[:, :3]
    position, speed = targets[0], np.zeros(3)
    way = np.empty_like(targets)
    for at, target in enumerate(targets):
        away = position - target
        position, speed = target + stay * away + push * speed, swing * away + keep * speed
        way[at] = position
    return Trajectory(path.time, way)
