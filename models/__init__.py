"""Particle fluid: stirring and pouring scenes. Taichi loads with the first simulation."""

from .accuracy import stirring_error
from .cups import Cups
from .effect import Effect
from .effects import EFFECTS, register
from .faults import FailedSimulation
from .frames import PourFrames, StirFrames, pour_frames, stir_frames
from .liquid import Liquid
from .numerics import MODEL_VERSION, Numerics, UntestedResolution
from .pouring import Landings, PourAction, PourBatch, PourResult, landings, pour
from .rig import Rig
from .runtime import TimeLimitExceeded, time_limit
from .stir_setup import Cup, Stick, StirSetup
from .stirring import stir

__all__ = [
    "EFFECTS",
    "MODEL_VERSION",
    "Cup",
    "Cups",
    "Effect",
    "FailedSimulation",
    "Landings",
    "Liquid",
    "Numerics",
    "PourAction",
    "PourBatch",
    "PourFrames",
    "PourResult",
    "Rig",
    "Stick",
    "StirFrames",
    "StirSetup",
    "TimeLimitExceeded",
    "UntestedResolution",
    "landings",
    "pour",
    "pour_frames",
    "register",
    "stir",
    "stir_frames",
    "stirring_error",
    "time_limit",
]
