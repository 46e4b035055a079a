"""Likelihood-free Bayesian inference for expensive, noisy simulators of time series.

Public names only; what is not listed may change. Nothing here knows what is simulated.
"""

from .acquisition import LowerConfidenceBound
from .bank import Simulation, SimulationBank
from .base import Acquisition, Discrepancy, Simulator, Surrogate
from .bolfi import Bolfi
from .checks import (
    SBC,
    Coverage,
    FitPipeline,
    Pipeline,
    Quantity,
    Replicates,
    SharedDesign,
    Tarp,
    coverage,
    replicates,
    sbc,
    shared_design,
    tarp,
)
from .discrepancy import squared_difference
from .likelihood import Quantile
from .loop import fit
from .posterior import Closest, Fit
from .prior import Prior
from .simulate import Job, run_missing

__all__ = [
    "SBC",
    "Acquisition",
    "Bolfi",
    "Closest",
    "Coverage",
    "Discrepancy",
    "Fit",
    "FitPipeline",
    "Job",
    "LowerConfidenceBound",
    "Pipeline",
    "Prior",
    "Quantile",
    "Quantity",
    "Replicates",
    "SharedDesign",
    "Simulation",
    "SimulationBank",
    "Simulator",
    "Surrogate",
    "Tarp",
    "coverage",
    "fit",
    "replicates",
    "run_missing",
    "sbc",
    "shared_design",
    "squared_difference",
    "tarp",
]
