"""Likelihood-free Bayesian inference for expensive, noisy simulators of time series.

Public names only; what is not listed may change. Nothing here knows what is simulated.
"""

from .acquisition import LowerConfidenceBound
from .bank import Simulation, SimulationBank
from .base import Acquisition, Discrepancy, Simulator, Surrogate
from .bolfi import Bolfi
from .convergence import SamplingWarning
from .discrepancy import squared_difference
from .likelihood import Quantile
from .loop import fit
from .posterior import Closest, Fit
from .prior import Prior
from .simulate import Job, run_missing

__all__ = [
    "Acquisition",
    "Bolfi",
    "Closest",
    "Discrepancy",
    "Fit",
    "Job",
    "LowerConfidenceBound",
    "Prior",
    "Quantile",
    "SamplingWarning",
    "Simulation",
    "SimulationBank",
    "Simulator",
    "Surrogate",
    "fit",
    "run_missing",
    "squared_difference",
]
