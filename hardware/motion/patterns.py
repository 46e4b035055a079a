"""Stirring patterns as timed paths of the gripper."""

import numpy as np

from .poses import Trajectory


def star(  # noqa: PLR0913  a pattern has that many sizes
    *,
    speed: float,
    height: float,
    radius: float = 0.025,
    points: int = 9,
    acceleration: float = 1.0,
    rest: float = 0.5,
    pause: float = 0.0,
    cycles: int = 1,
    rate: float = 30.0,
) -> Trajectory:
    """A star of straight strokes in a horizontal plane ("To Stir or Not to Stir": m = 9).

    The gripper rests above the cup's axis, moves to the first of `points` vertices on a circle,
    visits all of them by the longest strokes that close into one star, and rests again. Each
    stroke starts and ends at rest, with a trapezoidal speed profile.

    Args:
        speed: Greatest speed [m/s].
        height: Gripper above the cup's floor [m].
        radius: Of the circle of vertices [m].
        points: Number of vertices, odd; or 2, of a line.
        acceleration: Of each stroke's ends [m/s²].
        rest: Time at rest before and after [s].
        pause: Time at rest at each vertex [s].
        cycles: How often all vertices are visited.
        rate: Samples per second.

    Raises:
        ValueError: an argument is not positive and finite, `points` is no number of vertices, or
            `pause` is negative.
    """
    check_positive(
        speed=speed,
        height=height,
        radius=radius,
        acceleration=acceleration,
        rest=rest,
        cycles=cycles,
        rate=rate,
    )
    if not 0.0 <= pause < np.inf:
        raise ValueError(f"pause must be finite and not negative, got {pause}")
    vertices = star_vertices(points, radius)
    corners = np.concatenate([np.zeros((1, 2)), vertices, *[vertices[1:]] * (int(cycles) - 1)])

    strokes = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    # a short stroke never reaches the full speed
    peaks = np.minimum(speed, np.sqrt(strokes * acceleration))
    ramps = peaks / acceleration
    durations = strokes / peaks + ramps
    starts = rest + np.concatenate([[0.0], np.cumsum(durations + pause)])

    time = np.arange(0.0, starts[-1] - pause + rest, 1.0 / rate)
    k = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(strokes) - 1)
    elapsed = np.clip(time - starts[k], 0.0, durations[k])
    share = travelled(elapsed, durations[k], ramps[k], peaks[k]) / strokes[k]
    plane = corners[k] + share[:, None] * (corners[k + 1] - corners[k])
    return Trajectory(time, np.column_stack([plane, np.full(len(time), height)]))


def star_vertices(points: int, radius: float) -> np.ndarray:
    """Vertices of a closed star in their order, the first one again at the end; 2 are of a line.

    Returns:
        x and y [m], shape (points + 1, 2).

    Raises:
        ValueError: `points` is below 2, or even and not 2: the strokes would miss vertices.
    """
    if points < 2 or (points % 2 == 0 and points != 2):
        raise ValueError(f"points must be odd, or 2 for a line, got {points}; the paper uses 9")
    angles = 2.0 * np.pi * (points // 2) * np.arange(points + 1) / points
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def check_positive(**sizes: float) -> None:
    """Raise `ValueError` that names the first which is not positive and finite."""
    for name, value in sizes.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be positive and finite, got {value}")


def travelled(
    elapsed: np.ndarray,
    duration: np.ndarray | float,
    ramp: np.ndarray | float,
    peak: np.ndarray | float,
) -> np.ndarray:
    """Distance covered `elapsed`, between 0 and `duration`, into strokes of trapezoidal speed."""
    rising = np.minimum(elapsed, ramp)
    falling = np.maximum(elapsed - (duration - ramp), 0.0)
    cruising = np.clip(elapsed - ramp, 0.0, duration - 2.0 * ramp)
    slowing = peak * falling - 0.5 * peak / ramp * falling**2
    return 0.5 * peak / ramp * rising**2 + peak * cruising + slowing


def circle(
    *,
    speed: float,
    height: float,
    radius: float = 0.02,
    turns: float = 4.0,
    rest: float = 0.5,
    rate: float = 30.0,
) -> Trajectory:
    """Turns on a horizontal circle about the cup's axis, reached and left along a spiral.

    The radius grows over the first half turn and shrinks over the last, both smoothly.

    Args:
        speed: On the circle [m/s].
        height: Gripper above the cup's floor [m].
        radius: Of the circle [m].
        turns: In all, at least 2.
        rest: Time at rest before and after [s].
        rate: Samples per second.

    Raises:
        ValueError: an argument is not positive and finite, or there are fewer than 2 turns.
    """
    check_positive(speed=speed, height=height, radius=radius, rest=rest, rate=rate)
    if not (np.isfinite(turns) and turns >= 2):
        raise ValueError(f"turns must be at least 2, got {turns}")
    duration = turns * 2.0 * np.pi * radius / speed
    time = np.arange(0.0, duration + 2.0 * rest, 1.0 / rate)
    turned = turns * np.clip((time - rest) / duration, 0.0, 1.0)
    near = np.clip(2.0 * np.minimum(turned, turns - turned), 0.0, 1.0)
    out = radius * np.sin(0.5 * np.pi * near) ** 2
    angle = 2.0 * np.pi * turned
    plane = np.column_stack([out * np.cos(angle), out * np.sin(angle)])
    return Trajectory(time, np.column_stack([plane, np.full(len(time), height)]))
