"""Simulators that stop themselves when their time is over."""

from contextlib import AbstractContextManager


class TimeLimited:
    """Has the engine limit a simulator's time by `models.time_limit`, not by a thread."""

    def time_limit(self, seconds: float) -> AbstractContextManager[None]:
        """Inside, a simulation that takes longer raises TimeoutError."""
        from ..models import time_limit

        return time_limit(seconds)
