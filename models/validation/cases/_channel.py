"""What the cases between plates share: packings of each liquid, and the channel."""

from collections.abc import Callable

import numpy as np

from ...fluid.liquid import Liquid
from ..scenes.channel import Channel, Drive, Profiles, channel_flow

CHANNEL = Channel()
DENSITY = 1000.0
SPEED = 0.1  # m/s, of the plate or in the middle
VISCOSITY = (0.03, 0.1, 0.3, 1.0, 5.0, 20.0)
PACKINGS = 4
LOOKS, APART = 10, 0.05  # profiles of a steady flow, and the time between them [s]

Start = Callable[[np.ndarray], np.ndarray]


def flow(viscosity: float, drive: tuple[float, float], start: Start, looks, seed: int) -> Profiles:
    """One liquid in `PACKINGS` channels at the times `looks` [s].

    Args:
        drive: Speed of the lid [m/s] and push [m/s²].
    """
    lid_speed, push = (np.full(PACKINGS, value) for value in drive)
    liquid = Liquid(np.full(PACKINGS, viscosity), 0.0, DENSITY)
    return channel_flow(CHANNEL, liquid, Drive(lid_speed, push, start), looks, seed=seed)
