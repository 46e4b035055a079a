"""Likelihood-free Bayesian inference for expensive, noisy simulators.

Public names only; what is not listed may change. Nothing here knows what is simulated.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .acquisition import (
        ExpectedIntegratedVariance,
        LowerConfidenceBound,
        MaxVariance,
        PosteriorDraws,
    )
    from .bank import Simulation, SimulationBank, Simulations
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
    from .convergence import SamplingWarning
    from .discrepancy import squared_difference
    from .emulator_checks import EmulatorWarning
    from .families import DiscrepancyFamily, SignalFamily
    from .likelihood import Predicted, Quantile
    from .loop import fit
    from .posterior import Closest, Fit
    from .prior import Prior
    from .runner import run_missing
    from .simulate import Job

__all__ = [
    "Acquisition",
    "Bolfi",
    "Closest",
    "Coverage",
    "Discrepancy",
    "DiscrepancyFamily",
    "EmulatorWarning",
    "ExpectedIntegratedVariance",
    "Fit",
    "FitPipeline",
    "Job",
    "LowerConfidenceBound",
    "MaxVariance",
    "Pipeline",
    "PosteriorDraws",
    "Predicted",
    "Prior",
    "Quantile",
    "Quantity",
    "Replicates",
    "SBC",
    "SamplingWarning",
    "SharedDesign",
    "SignalFamily",
    "Simulation",
    "SimulationBank",
    "Simulations",
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

# loaded on use: a worker that imports `.simulate` to run a simulation must not pay for JAX
_HOME = {
    "Acquisition": ".base",
    "Bolfi": ".bolfi",
    "Closest": ".posterior",
    "Coverage": ".checks",
    "Discrepancy": ".base",
    "DiscrepancyFamily": ".families",
    "EmulatorWarning": ".emulator_checks",
    "ExpectedIntegratedVariance": ".acquisition",
    "Fit": ".posterior",
    "FitPipeline": ".checks",
    "Job": ".simulate",
    "LowerConfidenceBound": ".acquisition",
    "MaxVariance": ".acquisition",
    "Pipeline": ".checks",
    "PosteriorDraws": ".acquisition",
    "Predicted": ".likelihood",
    "Prior": ".prior",
    "Quantile": ".likelihood",
    "Quantity": ".checks",
    "Replicates": ".checks",
    "SBC": ".checks",
    "SamplingWarning": ".convergence",
    "SharedDesign": ".checks",
    "SignalFamily": ".families",
    "Simulation": ".bank",
    "SimulationBank": ".bank",
    "Simulations": ".bank",
    "Simulator": ".base",
    "Surrogate": ".base",
    "Tarp": ".checks",
    "coverage": ".checks",
    "fit": ".loop",
    "replicates": ".checks",
    "run_missing": ".runner",
    "sbc": ".checks",
    "shared_design": ".checks",
    "squared_difference": ".discrepancy",
    "tarp": ".checks",
}


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name], __name__), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
