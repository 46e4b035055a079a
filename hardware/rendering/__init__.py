"""Synthetic pictures of the stirring scene, for dry runs and as the truth of tests."""

from .boards import render_board, render_plumb_line
from .drawing import Stage, exposure_times, prepare, render
from .faults import Fault, fault_of
from .rehearsal import rehearsal_camera, rehearsal_scene, stick_view
from .scene import BRIGHT_STICK, CLEAN, Look, Scene
from .streamed_world import CupPlace, StreamedWorld, WorldError
from .world import MovingWorld, World, WorldState, direction

__all__ = [
    "BRIGHT_STICK",
    "CLEAN",
    "CupPlace",
    "Fault",
    "Look",
    "MovingWorld",
    "Scene",
    "Stage",
    "StreamedWorld",
    "World",
    "WorldError",
    "WorldState",
    "direction",
    "exposure_times",
    "fault_of",
    "prepare",
    "rehearsal_camera",
    "rehearsal_scene",
    "render",
    "render_board",
    "render_plumb_line",
    "stick_view",
]
