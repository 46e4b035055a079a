"""Cameras that are turned about the vertical against the robot's axes."""

import numpy as np

from ..effect import Effect, prior_of


def _signal(time, angles, coefficient):
    xz, yz = angles[..., 0], angles[..., 1]
    # the direction up to a positive factor, right also for a stick above the horizontal
    x, y = np.sin(xz) * np.abs(np.cos(yz)), np.abs(np.cos(xz)) * np.sin(yz)
    down = np.cos(xz) * np.abs(np.cos(yz))
    c, s = np.cos(coefficient)[:, None], np.sin(coefficient)[:, None]
    return np.stack([np.arctan2(c * x + s * y, down), np.arctan2(c * y - s * x, down)], axis=-1)


EFFECT = Effect(
    name="camera_rotation",
    unit="rad",
    neutral=0.0,
    acts_in="sensor",
    text="Both cameras together are turned about the vertical, from +x towards +y, so that each "
    "plane shows some of the other.",
    source="Components of the stick's direction in axes turned by the angle",
    make_prior=prior_of("Normal", 0.0, np.radians(5.0)),
    signal=_signal,
)
