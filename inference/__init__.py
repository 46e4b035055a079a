"""Likelihood-free Bayesian inference for expensive, noisy simulators of time series.

Public names only; what is not listed may change. Nothing here knows what is simulated.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .acquisition import LowerConfidenceBound
    from .bank import Simulation, SimulationBank, Simulations
    from .base import Acquisition, Discrepancy, Simulator, Surrogate
    from .bolfi import Bolfi
    from .discrepancy import squared_difference
    from .likelihood import Quantile
    from .loop import fit
    from .posterior import Closest, Fit
    from .prior import Prior
    from .runner import run_missing
    from .simulate import Job

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
    "Simulation",
    "SimulationBank",
    "Simulations",
    "Simulator",
    "Surrogate",
    "fit",
    "run_missing",
    "squared_difference",
]

# loaded on use: a worker that imports `.simulate` to run a simulation must not pay for JAX
_HOME = {
    "Acquisition": ".base",
    "Bolfi": ".bolfi",
    "Closest": ".posterior",
    "Discrepancy": ".base",
    "Fit": ".posterior",
    "Job": ".simulate",
    "LowerConfidenceBound": ".acquisition",
    "Prior": ".prior",
    "Quantile": ".likelihood",
    "Simulation": ".bank",
    "SimulationBank": ".bank",
    "Simulations": ".bank",
    "Simulator": ".base",
    "Surrogate": ".base",
    "fit": ".loop",
    "run_missing": ".runner",
    "squared_difference": ".discrepancy",
}


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name], __name__), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
