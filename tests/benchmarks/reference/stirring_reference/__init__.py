"""A stick that stirs a liquid, by the Navier-Stokes equations on a grid.

A reference for solvers that are fast enough to learn a liquid from its stirring; it is slow, and
independent of them. A staggered grid fills a box around the cup; the surfaces of cup and stick are
points that hold the liquid to their velocity. The stick is a spherical pendulum. The liquid's
surface is a flat lid that slips: waves are left out, and so is a stick's bounce off the wall.

`force_on_cylinder` drives a cylinder through the same solver in two dimensions, where exact
solutions and published drag are known.
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[3] / "physics"))  # where truths are, for scripts, too

from .cylinder import CylinderForce, CylinderScene, force_on_cylinder
from .gripper_paths import GripperPath, Motion, circle, polygon, star
from .scene import Liquid, Resolution, StirScene
from .stir import Stir, reference_stir

__all__ = [
    "CylinderForce",
    "CylinderScene",
    "GripperPath",
    "Liquid",
    "Motion",
    "Resolution",
    "Stir",
    "StirScene",
    "circle",
    "force_on_cylinder",
    "polygon",
    "reference_stir",
    "star",
]
