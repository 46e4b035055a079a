"""What the engine should know of simulators of the fluid."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import ClassVar


class FluidSimulator:
    """Stops itself when its time is over, and is fastest with several simulations in a call.

    Attributes:
        together: Simulations that one thread makes at the same time.
    """

    together: ClassVar[int] = 4

    def time_limit(self, seconds: float) -> AbstractContextManager[None]:
        """Inside, a simulation that takes longer raises TimeoutError."""
        from ..models import time_limit

        return time_limit(seconds)

    @property
    def neutral(self) -> Mapping[str, float]:
        """Coefficients that change nothing: runs with other effects share a call."""
        from ..models import EFFECTS

        return {name: effect.neutral for name, effect in EFFECTS.items()}
