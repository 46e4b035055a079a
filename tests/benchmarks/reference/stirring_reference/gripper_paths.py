"""Paths of the gripper in the plane, with the velocity and acceleration along them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Motion(NamedTuple):
    """At one moment; x, y and z.

    Attributes:
        position: From the cup's axis, at the height of the pivot [m], shape [3].
        velocity: [m/s], shape [3].
        acceleration: [m/s²], shape [3].
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]


@dataclass(frozen=True)
class GripperPath:
    """Where the gripper is at each moment.

    Attributes:
        motion: Of the gripper at a time [s]; at rest before 0 and after `duration`.
        duration: Of the whole path [s].
    """

    motion: Callable[[float], Motion]
    duration: float


class _Stroke(NamedTuple):
    """A straight way from rest to rest: speed up, glide, slow down."""

    begin: float  # s
    start: NDArray[np.float64]  # m
    direction: NDArray[np.float64]
    length: float  # m
    speed: float  # m/s
    acceleration: float  # m/s²

    @property
    def ramp(self) -> float:
        """Time of speeding up, and of slowing down [s]."""
        return self.speed / self.acceleration

    @property
    def duration(self) -> float:
        return self.length / self.speed + self.ramp

    @property
    def end(self) -> float:
        return self.begin + self.duration

    def motion(self, time: float) -> Motion:
        factors = self._along(min(max(time - self.begin, 0.0), self.duration))
        distance, speed, acceleration = (factor * self.direction for factor in factors)
        return Motion(self.start + distance, speed, acceleration)

    def _along(self, elapsed: float) -> tuple[float, float, float]:
        """Distance, speed and acceleration along the way."""
        left = self.duration - elapsed
        if elapsed <= 0.0 or left <= 0.0:
            return (0.0 if elapsed <= 0.0 else self.length), 0.0, 0.0
        rate, ramp = self.acceleration, self.ramp
        if elapsed < ramp:
            return 0.5 * rate * elapsed**2, rate * elapsed, rate
        if left < ramp:
            return self.length - 0.5 * rate * left**2, rate * left, -rate
        return self.speed * (elapsed - 0.5 * ramp), self.speed, 0.0


def polygon(
    corners: ArrayLike,
    speed: float,
    *,
    acceleration: float = 1.0,
    lead: float = 0.5,
    tail: float = 0.5,
) -> GripperPath:
    """Straight strokes from corner to corner, each from rest to rest.

    Args:
        corners: x and y in order [m], shape [n, 2], n at least 2.
        speed: Highest speed [m/s]; a short stroke does not reach it.
        acceleration: At both ends of each stroke [m/s²].
        lead, tail: Rest before and after [s].

    Raises:
        ValueError: the corners are of another shape or two in a row are the same, or a number
            is not positive.
    """
    points = np.asarray(corners, float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
        raise ValueError(f"corners must have shape [n, 2] with n of 2 or more, got {points.shape}")
    if min(speed, acceleration) <= 0.0 or min(lead, tail) < 0.0:
        raise ValueError(
            "speed and acceleration must be positive, lead and tail 0 or more, got "
            f"{speed}, {acceleration}, {lead} and {tail}"
        )
    strokes = _strokes(points, speed, acceleration, lead)

    def motion(time: float) -> Motion:
        return next((s for s in strokes if time < s.end), strokes[-1]).motion(time)

    return GripperPath(motion, strokes[-1].end + tail)


def _strokes(
    points: NDArray[np.float64], speed: float, acceleration: float, begin: float
) -> Sequence[_Stroke]:
    strokes = []
    level = np.column_stack([points, np.zeros(len(points))])
    for start, way in zip(level, np.diff(level, axis=0), strict=False):
        length = float(np.linalg.norm(way))
        if length == 0.0:
            raise ValueError(f"corners: {start[:2]} comes twice in a row; leave one out")
        reached = min(speed, math.sqrt(length * acceleration))
        stroke = _Stroke(begin, start, way / length, length, reached, acceleration)
        strokes.append(stroke)
        begin = stroke.end
    return strokes


def star(
    radius: float,
    speed: float,
    *,
    points: int = 9,
    skip: int = 4,
    lead: float = 0.5,
    tail: float = 0.5,
) -> GripperPath:
    """From the cup's axis to the first point of a star, and once along all of its strokes.

    Args:
        radius: From the axis to the star's points [m].
        speed: Highest speed [m/s].
        points: Of the star.
        skip: Each stroke goes to the point so many ahead; without a divisor in common with
            `points`, or some points are left out.
        lead, tail: Rest before and after [s].

    Raises:
        ValueError: `points` and `skip` make no star, or as `polygon`.
    """
    if math.gcd(points, skip) != 1:
        raise ValueError(f"a star of {points} points cannot skip to each {skip}th of them")
    angle = 2.0 * np.pi * (skip * np.arange(points + 1) % points) / points
    tips = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return polygon(np.vstack([[0.0, 0.0], tips]), speed, lead=lead, tail=tail)


def circle(
    radius: float,
    speed: float,
    *,
    turns: float = 3.0,
    ramp: float = 0.6,
    lead: float = 0.5,
    tail: float = 0.5,
) -> GripperPath:
    """Round and round the cup's axis, from a point of the circle.

    Args:
        radius: [m].
        speed: Between the ramps [m/s].
        turns: How many.
        ramp: Time in which the speed rises, and falls, like half a cosine [s].
        lead, tail: Rest before and after [s].

    Raises:
        ValueError: the turns are over before the speed has risen and fallen.
    """
    rate, whole = speed / radius, 2.0 * np.pi * turns
    moving = whole / rate + ramp
    if moving < 2.0 * ramp:
        raise ValueError(f"{turns} turns take {moving:.3g} s, less than two ramps of {ramp} s")

    def motion(time: float) -> Motion:
        elapsed = min(max(time - lead, 0.0), moving)
        angle, first, second = _ramped(min(elapsed, moving - elapsed), rate, ramp)
        if elapsed > moving / 2.0:
            angle, second = whole - angle, -second
        outward = np.array([math.cos(angle), math.sin(angle), 0.0])
        ahead = np.array([-math.sin(angle), math.cos(angle), 0.0])
        return Motion(
            radius * outward, radius * first * ahead, radius * (second * ahead - first**2 * outward)
        )

    return GripperPath(motion, lead + moving + tail)


def _ramped(elapsed: float, rate: float, ramp: float) -> tuple[float, float, float]:
    """Angle and its two derivatives [rad, s] while the rate rises to `rate` and then stays."""
    if elapsed >= ramp:
        return rate * (elapsed - 0.5 * ramp), rate, 0.0
    pace = np.pi / ramp
    phase = pace * elapsed
    return (
        0.5 * rate * (elapsed - math.sin(phase) / pace),
        0.5 * rate * (1.0 - math.cos(phase)),
        0.5 * rate * pace * math.sin(phase),
    )
