"""Every argument of every public name is refused by its name where it makes no sense.

The names are those of `inference`, found by themselves: a new one without a case fails, and so does
a new argument that takes anything. Nothing is simulated before an argument is refused.
"""

import inspect
import re
from concurrent.futures import ProcessPoolExecutor

import jax
import matplotlib
import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.criticism import Extension
from bolfi_liquids.inference.simulations import Simulation

from bolfi_liquids import inference

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings(
        "ignore::bolfi_liquids.inference.EmulatorWarning",
        "ignore::bolfi_liquids.inference.SamplingWarning",
    ),
]
matplotlib.use("agg")

MADE_BY_THE_ENGINE = {"Emulation", "Fit"}  # whose constructors are not for users
CALLED_BY_THE_ENGINE = {"learn", "measure", "observe", "search", "view"}
OBSERVED = np.linspace(0.0, 1.0, 30)
THETA = {"a": np.linspace(0.1, 0.9, 9)}
CALLS = []


class Wrong:
    """What no argument can be."""

    def __repr__(self):
        return "<Wrong>"


def simulate(theta, seeds):
    CALLS.append(theta)
    return np.asarray(theta["a"])[:, None] * OBSERVED


def pipeline(observed, seed):
    return {"a": np.random.default_rng(seed).random(15)}


@pytest.fixture(scope="module")
def cases():
    """Operation -> what is called, and arguments with which it works."""
    prior = inference.Prior({"a": dist.Uniform(0.0, 1.0)})
    engine = inference.Bolfi(prior, OBSERVED)
    signals = simulate(THETA, range(9))
    engine.tell(THETA, signals)
    fit = engine.fit()
    bank = inference.SimulationBank()
    bank.put("", {"a": 0.5}, 0, Simulation(signals[0], None, 0.0))
    of_fit = {"simulate": simulate, "prior": prior, "observed": OBSERVED}
    row = {"identity": "", "theta": {"a": 0.5}, "seed": 0}
    quick = {"n": 8, "draws": 7, "independent": True, "progress": False}
    of_pipeline = {"pipeline": pipeline, "simulate": simulate, "prior": prior, **quick}
    made = inference.replicates(**of_pipeline)
    by_fit = inference.fit(**of_fit, budget=4, noise=0.1, progress=False, warn=False)
    return {
        "fit": (inference.fit, {**of_fit, "budget": 4, "progress": False}),
        "fit_losses": (
            inference.fit_losses,
            {"theta": THETA, "loss": np.arange(9.0), "prior": prior, "noise": 1.0, "warn": False},
        ),
        "Bolfi": (inference.Bolfi, {"prior": prior, "observed": OBSERVED}),
        "Bolfi.ask": (inference.Bolfi(prior, OBSERVED).ask, {}),
        "Bolfi.tell": (engine.tell, {"theta": THETA, "signals": signals}),
        "Bolfi.fit": (engine.fit, {}),
        "Bolfi.confirm": (engine.confirm, {"fit": engine.fit(warn=False)}),
        "Fit.log_prob": (fit.log_prob, {"theta": THETA}),
        "Fit.sample": (fit.sample, {"sampler": "quadrature", "draws": 8}),
        "Prior": (inference.Prior, {"distributions": {"a": dist.Uniform(0.0, 1.0)}}),
        "Prior.describe": (prior.describe, {}),
        "Prior.to_array": (prior.to_array, {"theta": THETA}),
        "Prior.to_dict": (prior.to_dict, {"array": np.zeros((3, 1))}),
        "Prior.to_unit": (prior.to_unit, {"theta": THETA}),
        "Prior.from_unit": (prior.from_unit, {"u": np.zeros((3, 1))}),
        "Prior.contains": (prior.contains, {"theta": THETA}),
        "Prior.log_prob": (prior.log_prob, {"theta": THETA}),
        "Prior.sample": (prior.sample, {"key": jax.random.key(0), "n": 2}),
        "emulate": (
            inference.emulate,
            {
                "prior": prior,
                "theta": THETA,
                "outputs": signals,
                "scale": np.ones(signals.shape[1]),
            },
        ),
        "Emulation.predict": (
            inference.emulate(prior, THETA, signals, np.ones(signals.shape[1])).predict,
            {"theta": THETA},
        ),
        "SimulationBank": (inference.SimulationBank, {}),
        "SimulationBank.get": (bank.get, row),
        "SimulationBank.put": (bank.put, {**row, "simulation": Simulation(signals[0], None, 0.0)}),
        "SimulationBank.holds": (bank.holds, {"identity": ""}),
        "SimulationBank.simulations": (bank.simulations, {"identity": ""}),
        "SimulationBank.claim": (bank.claim, row),
        "SimulationBank.release": (bank.release, row),
        "SimulationBank.close": (inference.SimulationBank().close, {}),
        "SignalFamily": (inference.SignalFamily, {}),
        "DiscrepancyFamily": (inference.DiscrepancyFamily, {}),
        "LogLikelihoodFamily": (inference.LogLikelihoodFamily, {}),
        "LowerConfidenceBound": (inference.LowerConfidenceBound, {}),
        "MaxVariance": (inference.MaxVariance, {}),
        "PosteriorDraws": (inference.PosteriorDraws, {}),
        "CautiousDraws": (inference.CautiousDraws, {}),
        "ExpectedIntegratedVariance": (inference.ExpectedIntegratedVariance, {}),
        "squared_difference": (inference.squared_difference, {}),
        "relative": (inference.relative, {"share": 0.2}),
        "FitPipeline": (inference.FitPipeline, {"simulate": simulate, "prior": prior}),
        "shared_design": (
            inference.shared_design,
            {"simulate": simulate, "prior": prior, "n": 4, "progress": False},
        ),
        "replicates": (inference.replicates, of_pipeline),
        **{
            name: (getattr(inference, name), {"made": made}) for name in ("sbc", "coverage", "tarp")
        },
        "Fit.check": (by_fit.check, {**quick, "sampling": {"sampler": "quadrature"}}),
        "Fit.criticise": (
            by_fit.criticise,
            {"extensions": {"more": Extension(dist.Normal(0.0, 1.0), 0.0)}, "bank": ":memory:"},
        ),
    }


def operations():
    """Name, or class and method -> the function whose arguments a user gives."""
    found = {}
    for name in inference.__all__:
        one = getattr(inference, name)
        if inspect.ismodule(one) or getattr(one, "_is_protocol", False):
            continue
        if inspect.isclass(one) and issubclass(one, Warning):
            continue
        if not (inspect.isclass(one) and name in MADE_BY_THE_ENGINE):
            found[name] = one
        if inspect.isclass(one):
            methods = inspect.getmembers(one, inspect.isfunction)
            found |= {f"{name}.{m}": f for m, f in methods if m[0] != "_"}
    return {
        name: one for name, one in found.items() if name.split(".")[-1] not in CALLED_BY_THE_ENGINE
    }


OPERATIONS = operations()
ARGUMENTS = [
    (name, argument.name, argument.kind is argument.VAR_KEYWORD)
    for name, one in OPERATIONS.items()
    for argument in inspect.signature(one).parameters.values()
    if argument.name != "self"
]


def test_every_public_operation_has_a_case(cases):
    assert set(cases) == set(OPERATIONS)
    assert {"fit", "Prior.sample", "Fit.sample", "sbc"} <= set(OPERATIONS)  # none went unnoticed
    assert ("fit", "budget", False) in ARGUMENTS and ("Fit.sample", "draws", False) in ARGUMENTS


@pytest.mark.parametrize(("name", "argument", "more"), ARGUMENTS)
def test_an_argument_that_makes_no_sense_is_refused_by_its_name(cases, name, argument, more):
    call, good = cases[name]
    CALLS.clear()
    with pytest.raises((ValueError, TypeError)) as refused:
        call(**good, **{"nonsense": Wrong()}) if more else call(**good | {argument: Wrong()})
    told = str(refused.value)
    assert re.search(rf"\b{'nonsense' if more else argument}\b", told)
    assert more or "<Wrong>" in told
    assert not CALLS


def test_each_case_works_with_what_it_is_given(cases):
    """Else it might be refused for another reason."""
    for name, (call, good) in cases.items():
        if name != "Bolfi.tell":
            call(**good)


VALUES = {
    "fit": [
        {"simulate": 3},
        {"simulate": "simulate"},
        {"prior": {"a": dist.Uniform(0.0, 1.0)}},
        {"observed": np.full(30, np.nan)},
        {"observed": []},
        {"observed": "observed"},
        {"budget": -1},
        {"budget": 0},
        {"budget": 10.0},
        {"budget": True},
        {"budget": 10**8},
        {"batch": 10**9},
        {"initial": 10**9},
        {"earlier": ({"a": np.full(9000, 0.5)}, np.zeros((9000, 30)))},
        {"batch": -4},
        {"seed": 2**31},
        {"seed": -1},
        {"surrogate": 3},
        {"acquisition": lambda key: key},
        {"initial": 0},
        {"bank": ""},
        {"bank": 3},
        {"identity": None},
        {"timeout": 0},
        {"timeout": np.nan},
        {"timeout": "60"},
        {"executor": 4},
        {"executor": ProcessPoolExecutor},
        {"earlier": (THETA,)},
        {"vectorised": "no"},
        {"in_rounds": None},
        {"warn": 1},
        {"noise": "loud"},
        {"noise": -0.1},
        {"components": 0},
        {"predicted": 1.0},
        {"predicted": np.nan},
        {"summary": np.zeros(3)},
        {"discrepancy": "squared"},
        {"threshold": "best"},
        {"transform": "cube"},
    ],
    "Fit.sample": [
        {"sampler": ["nuts"]},
        {"chains": 1},
        {"draws": 3},
        {"draws": 10**12},
        {"draws": 1e3},
        {"warmup": 0},
        {"extend": 0},
        {"seed": -1},
        {"warn": "no"},
    ],
    "Prior": [
        {"distributions": {}},
        {"distributions": [dist.Uniform(0.0, 1.0)]},
        {"distributions": dist.Uniform(0.0, 1.0)},
        {"units": {"b": "m"}},
        {"units": ["m"]},
        {"units": "m"},
    ],
    "Bolfi": [{"initial": 10**6}],
    "Bolfi.ask": [{"n": 10**6}, {"n": -1}],
    "shared_design": [{"n": 10**6}, {"n": 2}, {"prior": 3}],
    "Prior.sample": [{"key": 0}, {"key": jax.random.split(jax.random.key(0))}, {"n": 0}],
    "coverage": [{"levels": 0.9}, {"levels": [0.5, 1.0]}, {"levels": []}, {"alpha": 0}],
    "sbc": [{"quantities": {"b": 3}}, {"quantities": [np.mean]}, {"alpha": 1.0}],
    "FitPipeline": [{"options": {"budget": 3}}, {"sampling": {"draw": 3}}, {"prior": "flat"}],
    "LowerConfidenceBound": [{"jitter": np.inf}, {"jitter": "small"}],
    "PosteriorDraws": [{"share": None}, {"share": np.nan}],
    "CautiousDraws": [{"share": None}, {"share": np.nan}],
}


@pytest.mark.parametrize(
    ("name", "argument", "value"),
    [(name, *pair) for name, given in VALUES.items() for one in given for pair in one.items()],
)
def test_a_value_that_makes_no_sense_is_refused_by_its_argument(cases, name, argument, value):
    call, good = cases[name]
    CALLS.clear()
    with pytest.raises((ValueError, TypeError), match=rf"\b{argument}\b"):
        call(**good | {argument: value})
    assert not CALLS
