"""Particle fluid: stirring and pouring scenes. Taichi loads with the first simulation."""

from .cups import Cups
from .liquid import Liquid
from .numerics import MODEL_VERSION, Numerics
from .pouring import PourAction, PourResult, pour
from .stirring import Cup, Stick, StirSetup, stir

__all__ = [
    "MODEL_VERSION",
    "Cup",
    "Cups",
    "Liquid",
    "Numerics",
    "PourAction",
    "PourResult",
    "Stick",
    "StirSetup",
    "pour",
    "stir",
]
