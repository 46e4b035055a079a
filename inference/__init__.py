"""Likelihood-free Bayesian inference for expensive, noisy simulators of time series.

Public names only; what is not listed may change. Nothing here knows what is simulated.
"""

from .acquisition import (
    ExpectedIntegratedVariance,
    LowerConfidenceBound,
    MaxVariance,
    PosteriorDraws,
)
from .bank import Simulation, SimulationBank
from .base import Acquisition, Discrepancy, Simulator, Surrogate
from .bolfi import Bolfi
from .discrepancy import squared_difference
from .families import DiscrepancyFamily, SignalFamily
from .likelihood import Predicted, Quantile
from .loop import fit
from .posterior import Closest, Fit
from .prior import Prior
from .simulate import Job, run_missing

__all__ = [
    "Acquisition",
    "Bolfi",
    "Closest",
    "Discrepancy",
    "DiscrepancyFamily",
    "ExpectedIntegratedVariance",
    "Fit",
    "Job",
    "LowerConfidenceBound",
    "MaxVariance",
    "PosteriorDraws",
    "Predicted",
    "Prior",
    "Quantile",
    "SignalFamily",
    "Simulation",
    "SimulationBank",
    "Simulator",
    "Surrogate",
    "fit",
    "run_missing",
    "squared_difference",
]
