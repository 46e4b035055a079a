"""Limits of a rig: what a commanded motion and a running one must keep.

A person may set them lower. Above the upper ends here none can be set: the arm works beside people.
"""

from typing import Annotated

import numpy as np

from .rig_numbers import (
    Acceleration,
    Coordinate,
    Length,
    Number,
    RigSection,
    Speed,
    contradiction,
    within,
)


class AxisLimits(RigSection, frozen=True):
    """A range for each axis [m], in the cup's frame."""

    x: tuple[Coordinate, Coordinate]
    y: tuple[Coordinate, Coordinate]
    z: tuple[Coordinate, Coordinate]

    @contradiction
    def _ascend(self) -> None:
        for name in ("x", "y", "z"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} must ascend, got [{low}, {high}]")

    @property
    def low(self) -> np.ndarray:
        """Lower corner, shape (3,)."""
        return np.array([self.x[0], self.y[0], self.z[0]])

    @property
    def high(self) -> np.ndarray:
        """Upper corner, shape (3,)."""
        return np.array([self.x[1], self.y[1], self.z[1]])


LARGEST_BOX = {
    # above a cup of a hand's size, with a stick of a forearm's length
    "stirring": AxisLimits(x=(-0.2, 0.2), y=(-0.2, 0.2), z=(0.05, 1.0)),
    # an arm's length about the cup, never below the table
    "pouring": AxisLimits(x=(-1.0, 1.0), y=(-1.0, 1.0), z=(0.0, 1.0)),
}
"""Where a tool may be let go at most, in the cup's frame."""


class Limits(RigSection, frozen=True):
    """What a commanded motion and a running one must keep.

    Attributes:
        stirring: Where the pivot may go.
        pouring: Where the source's lip may go.
        speed: Of the tool's centre [m/s].
        acceleration: Of it [m/s2].
        tilt_rate_deg_s: Of the tool.
        force: Change of the tool's force since rest [N].
        tracking_error: Between where the tool is and where it was told to be [m].
        latency: Between a command and its effect, which the box's margin allows for [s].
        silence: For which the controller may say nothing new [s].
        frame_age: Of a camera's latest picture [s].
        overrun: By which a tick of the motion loop may be late [s].
        reduced_mode: Whether the controller's reduced safety mode is good enough.
    """

    stirring: AxisLimits
    pouring: AxisLimits
    speed: Speed = 0.15
    acceleration: Acceleration = 0.5
    tilt_rate_deg_s: Annotated[
        Number, within(5.0, 180.0, "deg/s", "no pour is slower, and no wrist faster")
    ] = 180.0
    force: Annotated[
        Number,
        within(
            1.0,
            50.0,
            "N",
            "the arm's own noise is as large as 1 N; a face bears 65 N (ISO/TS 15066), and an arm "
            "pushes on while it stops",
        ),
    ] = 20.0
    tracking_error: Annotated[
        Length,
        within(0.001, 0.02, "m", "the arm follows within a few mm, or something holds it"),
    ] = 0.01
    latency: Annotated[
        Number, within(0.008, 0.5, "s", "no controller acts within less than its own period")
    ] = 0.05
    silence: Annotated[
        Number, within(0.01, 0.05, "s", "a controller says something new every 8 ms")
    ] = 0.05
    frame_age: Annotated[
        Number,
        within(
            0.004, 0.15, "s", "no camera is faster, and an arm must not go on unseen for longer"
        ),
    ] = 0.15
    overrun: Annotated[
        Number,
        within(0.002, 0.05, "s", "no computer keeps time better than to a millisecond or two"),
    ] = 0.05
    reduced_mode: bool = False

    @contradiction
    def _boxes_are_small(self) -> None:
        for name, most in LARGEST_BOX.items():
            box: AxisLimits = getattr(self, name)
            for axis in ("x", "y", "z"):
                (low, high), (least, largest) = getattr(box, axis), getattr(most, axis)
                if low < least or high > largest:
                    raise ValueError(
                        f"{name}.{axis} [{low}, {high}] m is not within [{least}, {largest}] m, "
                        "where an arm may be let go at most"
                    )
