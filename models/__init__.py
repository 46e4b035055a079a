"""Particle fluid: stirring and pouring scenes. Taichi loads with the first simulation."""

from .accuracy import stirring_error
from .cups import Cups
from .effect import Effect
from .effects import EFFECTS, register
from .fluid.faults import FailedSimulation
from .fluid.liquid import Liquid
from .fluid.numerics import MODEL_VERSION, PUBLISHED_DRAG, ParticleNumerics
from .fluid.runtime import TimeLimitExceeded, time_limit
from .frames import PourFrames, StirFrames, pour_frames, stir_frames
from .numerics import Numerics, UntestedResolution
from .pouring import Landings, PourAction, PourBatch, PourResult, landings, pour
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
    "ParticleNumerics",
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
