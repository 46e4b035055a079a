"""Criticism of a fitted simulator: where it and the data disagree, and what it lacks."""

from .clean_data import own_residual
from .criticise import Criticism, criticise
from .experiment import Experiment, Proposal
from .extension import Extension
from .held_out import Gap, beyond
from .hypothesis import Hypothesis
from .measurement_noise import (
    AutoregressiveNoise,
    KnownNoise,
    Noise,
    SumOfNoises,
    rest_noise,
)
from .misfit import Check, Found, Window
from .next_experiment import Suggestion
from .posterior import weighted_posterior
from .search import Plan
from .simulate import Keeping
from .usual_residual import UsualResidual, usual_residual
from .verdict import Candidate, Verdict

__all__ = [
    "AutoregressiveNoise",
    "Candidate",
    "Check",
    "Criticism",
    "Experiment",
    "Extension",
    "Found",
    "Gap",
    "Hypothesis",
    "Keeping",
    "KnownNoise",
    "Noise",
    "Plan",
    "Proposal",
    "Suggestion",
    "SumOfNoises",
    "UsualResidual",
    "Verdict",
    "Window",
    "beyond",
    "criticise",
    "own_residual",
    "rest_noise",
    "usual_residual",
    "weighted_posterior",
]
