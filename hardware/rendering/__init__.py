"""Synthetic pictures of the stirring scene, for rehearsals and as the truth of tests."""

from ..vision.stick_view import Scene
from .drawing import BRIGHT_STICK, Look, Stage, exposure_times, prepare, render
from .world import SharedWorld, World, WorldState, direction

__all__ = [
    "BRIGHT_STICK",
    "Look",
    "Scene",
    "SharedWorld",
    "Stage",
    "World",
    "WorldState",
    "direction",
    "exposure_times",
    "prepare",
    "render",
]
