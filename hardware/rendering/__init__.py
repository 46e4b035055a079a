"""Synthetic pictures of the stirring scene, for rehearsals and as the truth of tests."""

from .drawing import Stage, exposure_times, prepare, render
from .scene import BRIGHT_STICK, Look, Scene
from .shared_world import SharedWorld
from .world import World, WorldState, direction

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
