"""What the cases between plates share: packings of each liquid, and the channel."""

from collections.abc import Callable

import numpy as np

from ...liquid import Liquid
from ..scenes.channel import Channel, Drive, Profiles, channel_flow

CHANNEL = Channel()
DENSITY = 1000.0
SPEED = 0.1  # m/s, of the plate or in the middle
VISCOSITY = (0.03, 0.1, 0.3, 1.0, 5.0, 20.0)
PACKINGS = 4
LOOKS, APART = 10, 0.05  # profiles of a steady flow, and the time between them [s]

Start = Callable[[np.ndarray], np.ndarray]


def packed(viscosity: float, seed: int) -> tuple[Liquid, int]:
    """One liquid for `PACKINGS` channels, and the seed of their packings."""
    return Liquid(np.full(PACKINGS, viscosity), 0.0, DENSITY), seed


def flow(viscosity: float, drive: tuple[float, float], start: Start, seconds, seed: int) -> Profiles:
    """Profiles of `PACKINGS` channels; `drive` is the lid's speed and the push."""
    lid_speed, push = (np.full(PACKINGS, value) for value in drive)
    liquid, seed = packed(viscosity, seed)
    return channel_flow(CHANNEL, liquid, Drive(lid_speed, push, start), seconds, seed=seed)
