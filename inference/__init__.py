"""Likelihood-free Bayesian inference for expensive, noisy simulators.

Public names only; what is not listed may change. Nothing here knows what is simulated.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .acquisition.rules import (
        ExpectedIntegratedVariance,
        LowerConfidenceBound,
        MaxVariance,
        PosteriorDraws,
    )
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
    from .criticism import (
        AutoregressiveNoise,
        Candidate,
        Check,
        Criticism,
        Experiment,
        Extension,
        Found,
        Gap,
        Hypothesis,
        Keeping,
        KnownNoise,
        Noise,
        Plan,
        Proposal,
        Suggestion,
        SumOfNoises,
        UsualResidual,
        Verdict,
        Window,
        beyond,
        criticise,
        own_residual,
        rest_noise,
        usual_residual,
        weighted_posterior,
    )
    from .engine_version import ENGINE_VERSION
    from .loop import fit
    from .prior import Prior
    from .result import Closest, Fit
    from .sampling.convergence import SamplingWarning
    from .simulations.bank import Simulation, SimulationBank, Simulations
    from .simulations.job import Job
    from .simulations.runner import run_missing
    from .surrogates.base import (
        Acquisition,
        Discrepancy,
        Simulator,
        Surrogate,
    )
    from .surrogates.families import DiscrepancyFamily, SignalFamily
    from .surrogates.squared_difference import squared_difference
    from .surrogates.threshold import Predicted, Quantile
    from .surrogates.warnings import EmulatorWarning

__all__ = [
    "Acquisition",
    "AutoregressiveNoise",
    "Bolfi",
    "Candidate",
    "Check",
    "Closest",
    "Coverage",
    "Criticism",
    "Discrepancy",
    "DiscrepancyFamily",
    "ENGINE_VERSION",
    "EmulatorWarning",
    "ExpectedIntegratedVariance",
    "Experiment",
    "Extension",
    "Fit",
    "FitPipeline",
    "Found",
    "Gap",
    "Hypothesis",
    "Job",
    "Keeping",
    "KnownNoise",
    "LowerConfidenceBound",
    "MaxVariance",
    "Noise",
    "Pipeline",
    "Plan",
    "PosteriorDraws",
    "Predicted",
    "Prior",
    "Proposal",
    "Quantile",
    "Quantity",
    "Replicates",
    "SamplingWarning",
    "SBC",
    "SharedDesign",
    "SignalFamily",
    "Simulation",
    "SimulationBank",
    "Simulations",
    "Simulator",
    "Suggestion",
    "SumOfNoises",
    "Surrogate",
    "Tarp",
    "UsualResidual",
    "Verdict",
    "Window",
    "coverage",
    "beyond",
    "criticise",
    "fit",
    "own_residual",
    "replicates",
    "rest_noise",
    "run_missing",
    "sbc",
    "shared_design",
    "squared_difference",
    "tarp",
    "usual_residual",
    "weighted_posterior",
]

# loaded on use: a worker that imports `.simulate` to run a simulation must not pay for JAX
_HOME = {
    "Acquisition": ".surrogates.base",
    "AutoregressiveNoise": ".criticism",
    "Bolfi": ".bolfi",
    "Candidate": ".criticism",
    "Check": ".criticism",
    "Closest": ".result",
    "Coverage": ".checks",
    "Criticism": ".criticism",
    "Discrepancy": ".surrogates.base",
    "DiscrepancyFamily": ".surrogates.families",
    "ENGINE_VERSION": ".engine_version",
    "EmulatorWarning": ".surrogates.warnings",
    "ExpectedIntegratedVariance": ".acquisition.rules",
    "Experiment": ".criticism",
    "Extension": ".criticism",
    "Fit": ".result",
    "FitPipeline": ".checks",
    "Found": ".criticism",
    "Gap": ".criticism",
    "Hypothesis": ".criticism",
    "Job": ".simulations.job",
    "Keeping": ".criticism",
    "KnownNoise": ".criticism",
    "LowerConfidenceBound": ".acquisition.rules",
    "MaxVariance": ".acquisition.rules",
    "Noise": ".criticism",
    "Pipeline": ".checks",
    "Plan": ".criticism",
    "PosteriorDraws": ".acquisition.rules",
    "Predicted": ".surrogates.threshold",
    "Prior": ".prior",
    "Proposal": ".criticism",
    "Quantile": ".surrogates.threshold",
    "Quantity": ".checks",
    "Replicates": ".checks",
    "SamplingWarning": ".sampling.convergence",
    "SBC": ".checks",
    "SharedDesign": ".checks",
    "SignalFamily": ".surrogates.families",
    "Simulation": ".simulations.bank",
    "SimulationBank": ".simulations.bank",
    "Simulations": ".simulations.bank",
    "Simulator": ".surrogates.base",
    "Suggestion": ".criticism",
    "SumOfNoises": ".criticism",
    "Surrogate": ".surrogates.base",
    "Tarp": ".checks",
    "UsualResidual": ".criticism",
    "Verdict": ".criticism",
    "Window": ".criticism",
    "coverage": ".checks",
    "beyond": ".criticism",
    "criticise": ".criticism",
    "fit": ".loop",
    "own_residual": ".criticism",
    "replicates": ".checks",
    "rest_noise": ".criticism",
    "run_missing": ".simulations.runner",
    "sbc": ".checks",
    "shared_design": ".checks",
    "squared_difference": ".surrogates.squared_difference",
    "tarp": ".checks",
    "usual_residual": ".criticism",
    "weighted_posterior": ".criticism",
}


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name], __name__), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
