"""Is a posterior calibrated? Checks of any pipeline on data whose truth is known."""

from .intervals import Coverage, coverage
from .pipelines import FitPipeline, SharedDesign, shared_design
from .random_points import Tarp, tarp
from .repeat import replicates
from .replicate import Pipeline, Replicate
from .replicated import Quantity, Replicates
from .uniformity import SBC, sbc

__all__ = [
    "SBC",
    "Coverage",
    "FitPipeline",
    "Pipeline",
    "Quantity",
    "Replicate",
    "Replicates",
    "SharedDesign",
    "Tarp",
    "coverage",
    "replicates",
    "sbc",
    "shared_design",
    "tarp",
]
