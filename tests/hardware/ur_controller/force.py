"""Reading of the force at the TCP."""

import random

from bolfi_liquids.hardware.emulated.arm import FORCE_NOISE


class ForceReading:
    """Zero, noise, and what an operator of the emulator presses with, less the zero offset."""

    def __init__(self, seed: int):
        self._random = random.Random(seed)
        self._pressed = (0.0,) * 6
        self._offset = (0.0,) * 6

    def press(self, wrench: tuple[float, ...]) -> None:
        """Force [N] and torque [Nm] from now on, until the next call."""
        self._pressed = wrench

    def zero(self) -> None:
        self._offset = self._pressed

    def read(self) -> tuple[float, ...]:
        gauss = self._random.gauss
        return tuple(
            pressed - offset + gauss(0.0, noise)
            for pressed, offset, noise in zip(self._pressed, self._offset, FORCE_NOISE, strict=True)
        )
