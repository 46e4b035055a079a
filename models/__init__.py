"""Particle fluid: stirring and pouring scenes. Taichi loads with the first simulation."""

from .cups import Cups
from .effect import Effect
from .effects import EFFECTS, register
from .faults import FailedSimulation
from .liquid import Liquid
from .numerics import MODEL_VERSION, PUBLISHED_DRAG, Numerics
from .pouring import Landings, PourAction, PourResult, landings, pour
from .rig import Rig
from .stir_setup import Cup, Stick, StirSetup
from .stirring import stir

__all__ = [
    "EFFECTS",
    "MODEL_VERSION",
    "PUBLISHED_DRAG",
    "Cup",
    "Cups",
    "Effect",
    "FailedSimulation",
    "Landings",
    "Liquid",
    "Numerics",
    "PourAction",
    "PourResult",
    "Rig",
    "Stick",
    "StirSetup",
    "landings",
    "pour",
    "register",
    "stir",
]
