"""Reading of the force at the TCP."""

import random

from bolfi_liquids.hardware.emulated.arm import FORCE_NOISE


class ForceReading:
    """Noise, and what an operator of the emulator presses with."""

    def __init__(self, seed: int):
        self._random = random.Random(seed)
        self._pressed = (0.0,) * 6

    def press(self, wrench: tuple[float, ...]) -> None:
        """Force [N] and torque [Nm] from now on, until the next call."""
        self._pressed = wrench

    def read(self) -> tuple[float, ...]:
        gauss = self._random.gauss
        return tuple(
            pressed + gauss(0.0, noise)
            for pressed, noise in zip(self._pressed, FORCE_NOISE, strict=True)
        )
