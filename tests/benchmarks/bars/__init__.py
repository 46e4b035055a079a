"""What the fluid is held to, measured: each module yields lines of one table."""

from .line import HEAD, Line, row
from .peer import against_peer
from .speed import start_up, stirring_seconds, throughput

__all__ = [
    "HEAD",
    "Line",
    "against_peer",
    "row",
    "start_up",
    "stirring_seconds",
    "throughput",
]
