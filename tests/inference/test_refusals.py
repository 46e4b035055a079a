"""Every argument of every public name is refused by its name where it makes no sense.

The names are those of `inference`, found by themselves: a new one without a case fails, and so does
a new argument that takes anything. Nothing is simulated before an argument is refused.
"""

import inspect
import multiprocessing
import re
import tempfile
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from pathlib import Path

import jax
import matplotlib
import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism import Extension
from bolfi_liquids.inference.simulations import (
    BatchSimulator,
    Compute,
    Simulation,
    jobs,
    open_compute,
    run_missing,
)
from bolfi_liquids.inference.simulations.job import for_engine
from bolfi_liquids.inference.surrogates import Quantile
from bolfi_liquids.inference.surrogates.threshold import Matched, Predicted

from bolfi_liquids import inference

pytestmark = pytest.mark.filterwarnings(
    "ignore::bolfi_liquids.inference.EmulatorWarning",
    "ignore::bolfi_liquids.inference.SamplingWarning",
)
matplotlib.use("agg")

MADE_BY_THE_ENGINE = {"Emulation", "Fit"}  # whose constructors are not for users
CALLED_BY_THE_ENGINE = {"check_prior", "learn", "measure", "observe", "search", "view"}
OBSERVED = np.linspace(0.0, 1.0, 30)
THETA = {"a": np.linspace(0.1, 0.9, 9)}
PRIOR = inference.Prior({"a": dist.Uniform(0.0, 1.0)})
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
    prior = PRIOR
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
        "from_trials": (
            inference.from_trials,
            {
                "trials": {**THETA, "loss": np.arange(9.0)},
                **{"prior": prior, "noise": 1.0, "warn": False},
            },
        ),
        "Bolfi": (inference.Bolfi, {"prior": prior, "observed": OBSERVED}),
        "Bolfi.ask": (inference.Bolfi(prior, OBSERVED).ask, {}),
        "Bolfi.tell": (engine.tell, {"theta": THETA, "signals": signals}),
        "Bolfi.fit": (engine.fit, {}),
        "Bolfi.confirm": (engine.confirm, {"fit": engine.fit(warn=False)}),
        "Fit.log_prob": (fit.log_prob, {"theta": THETA}),
        "Fit.sample": (fit.sample, {"sampler": "quadrature", "draws": 8}),
        "Fit.report": (fit.report, {"path": Path(tempfile.mkdtemp()) / "fit.html"}),
        "Fit.save": (fit.save, {"path": Path(tempfile.mkdtemp()) / "fit"}),
        "Fit.sobol": (fit.sobol, {"n": 64}),
        "Fit.quantiles": (fit.quantiles, {"levels": (0.1, 0.9)}),
        "Fit.interval_error": (fit.interval_error, {"more": 3}),
        "Until": (inference.Until, {"tolerance": 0.1, "most": 30, "error": len}),
        "Prior": (inference.Prior, {"distributions": {"a": dist.Uniform(0.0, 1.0)}}),
        "Prior.describe": (prior.describe, {}),
        "Prior.to_array": (prior.to_array, {"theta": THETA}),
        "Prior.to_dict": (prior.to_dict, {"array": np.zeros((3, 1))}),
        "Prior.to_unit": (prior.to_unit, {"theta": THETA}),
        "Prior.from_unit": (prior.from_unit, {"u": np.zeros((3, 1))}),
        "Prior.contains": (prior.contains, {"theta": THETA}),
        "Prior.log_prob": (prior.log_prob, {"theta": THETA}),
        "Prior.log_probs": (prior.log_probs, {"theta": THETA}),
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
        "Program": (inference.Program, {"command": "model {a} {in}"}),
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
FAR = {"a": np.linspace(0.1, 1.9, 9)}  # half of it outside of the prior
MANY = {"a": np.full(9000, 0.5)}
GOOD = np.zeros((9, 30))
SEEDS = [*range(9)]


VALUES = {
    "fit": [
        *({"simulate": 3}, {"prior": {"a": dist.Uniform(0.0, 1.0)}}),
        *({"observed": np.full(30, np.nan)}, {"observed": []}, {"observed": "observed"}),
        *({"observed": None}, {"observed": np.full(30, np.inf)}, {"observed": np.ones(30) + 1j}),
        *({"budget": -1}, {"budget": 2}, {"budget": 10.0}, {"budget": True}, {"budget": 10**8}),
        *({"budget": 5, "initial": 6}, {"budget": 0, "earlier": (THETA, GOOD), "initial": 10}),
        *({"batch": 0}, {"batch": 2.0}, {"batch": 10**9}, {"initial": 2}, {"initial": 10**9}),
        *({"seed": seed} for seed in (2**31, -1, 1.0, np.float64(3), True, "7", None, [7, 8])),
        *({"earlier": (MANY, np.zeros((9000, 30)))}, {"earlier": (THETA,)}, {"earlier": "runs"}),
        *({"earlier": {"theta": {}, "signals": []}}, {"earlier": (np.zeros((4, 2)), GOOD)}),
        ("signals", {"earlier": (THETA, "loud")}),
        ("theta", {"earlier": ({"a": [0.5, np.nan, np.inf]}, np.zeros((3, 30)))}),
        *({"surrogate": 3}, {"surrogate": "forest"}, {"surrogate": ["signal"]}),
        *({"acquisition": 3}, {"acquisition": "guess"}, {"acquisition": inference.MaxVariance}),
        *({"acquisition": lambda key: key}, {"acquisition": "lcb", "surrogate": "signal"}),
        *({"bank": ""}, {"bank": 3}, {"identity": None}, {"confirm": -1}),
        {"bank": 3, "executor": "tcp://127.0.0.1:1"},  # before a scheduler is waited for
        *({"timeout": 0}, {"timeout": -1.0}, {"timeout": np.nan}, {"timeout": np.inf}),
        *({"timeout": "60"}, {"executor": 4}, {"executor": ProcessPoolExecutor}),
        *({"vectorised": "no"}, {"in_rounds": None}, {"warn": 1}),
        *({"progress": None}, {"progress": 1}, {"progress": "bar"}),
        *({"noise": noise} for noise in ("loud", -0.1, {"sd": 1.0}, np.ones((2, 2)), np.ones(31))),
        *({"noise": noise} for noise in (-np.eye(30), np.triu(np.ones((30, 30))), 0.1 - OBSERVED)),
        *(
            {"noise": np.nan * OBSERVED},
            {"noise": inference.relative(0.2), "observed": 0 * OBSERVED},
        ),
        *({"noise": "poisson", "observed": -OBSERVED - 1.0}, {"noise": lambda mean: -mean - 1.0}),
        *({"noise": lambda mean: np.nan * mean}, {"noise": lambda mean: mean[:3] + 1.0}),
        *({"components": 0}, {"components": 2.5}, {"predicted": 1.0}, {"predicted": np.nan}),
        *({"summary": np.zeros(3)}, {"summary": lambda signal: "loud"}),
        *({"discrepancy": "squared"}, {"threshold": "best"}, {"threshold": lambda values: 0.1}),
        *({"transform": "cube"}, {"transform": ["log"]}),
        {"transform": "log", "surrogate": "signal"},
    ],
    "fit, log likelihood": [{"observed": [0.0]}],
    "Fit.sample": [
        *(
            {"sampler": "gibbs"},
            {"sampler": ["nuts"]},
            {"chains": 1},
            {"draws": 3},
            {"draws": 10**12},
            {"draws": 1e3},
        ),
        *({"warmup": 0}, {"extend": 0}, {"seed": -1}, {"warn": "no"}),
    ],
    "fit_losses": [
        *({"noise": None}, {"n": 3}, {"noise": 0.0}, {"n": 0, "noise": None, "loss": np.ones(9)}),
        *({"loss": -np.ones(9)}, {"loss": np.zeros(9), "noise": None, "n": 30}),
        *({"loss": np.ones(8)}, {"loss": np.full(9, np.nan)}),
    ],
    "from_trials": [
        *({"trials": THETA}, {"trials": {"loss": np.ones(9)}}, {"trials": 3}, {"prior": None}),
        *({"log_likelihood": True}, {"log_likelihood": None}, {"noise": None}, {"n": 3}),
        ("loss", {"trials": {**THETA, "loss": -np.ones(9)}}),
        ("theta", {"trials": {**FAR, "loss": np.ones(9)}}),
    ],
    "Prior": [
        *({"distributions": given} for given in ({}, dist.Uniform(0.0, 1.0), [dist.Normal()])),
        *({"distributions": given} for given in (lambda: None, lambda a: None)),
        *({"units": given} for given in ({"b": "m"}, {"a": 1.0}, ["m"], "m")),
    ],
    "Prior of one": [
        ("thickness", {"distributions": {"thickness": one}})
        for one in (
            *(dist.Uniform(1.0, 0.0), dist.Uniform(1.0, 1.0), dist.LogUniform(2.0, 1.0)),
            *(dist.Uniform(0.0, np.inf), dist.Uniform(np.nan, 1.0), dist.Normal(0.0, np.inf)),
            *(dist.TruncatedNormal(0.0, 1.0, low=2.0, high=1.0), dist.DiscreteUniform(1, 20)),
            *(dist.TruncatedNormal(0.0, 1.0, low=50.0), dist.Poisson(3.0), 1.0),
            *(dist.Normal(np.zeros(2), 1.0), dist.MultivariateNormal(np.zeros(2), np.eye(2))),
            dist.VonMises(0.0, 1.0),
        )
    ],
    "Fit.quantiles": [{"levels": (0.1, 1.1)}, {"levels": np.nan}],
    "Fit.interval_error": [{"more": -1}],
    "Until": [{"tolerance": 0.0}, {"tolerance": np.inf}, {"most": 2}],
    "Fit.sobol": [{"n": 1000}, {"n": 1}, {"n": 64.5}, {"seed": -1}],
    "Prior.to_array": [
        {"theta": theta}
        for theta in (0.5, {}, {"b": 1.0}, {"a": "thick"}, {"a": np.zeros((2, 2))}, {"a": np.nan})
    ],
    "Prior.from_unit": [{"u": 0.5}, {"u": np.zeros((4, 2))}, {"u": "middle"}],
    "Prior.sample": [{"key": 0}, {"key": jax.random.split(jax.random.key(0))}, {"n": 0}],
    "Fit.log_prob": [{"theta": 0.5}, {"theta": {"a": np.zeros((2, 2))}}],
    "Bolfi": [{"initial": 10**6}, {"initial": 1}, {"observed": [[1.0], [1.0, 2.0]]}],
    "Bolfi.ask": [{"n": 10**6}, {"n": 0}],
    "Bolfi.tell": [
        *({"signals": GOOD[:, :29]}, {"signals": [*GOOD[:, :29]]}, {"signals": "loud"}),
        *({"theta": 0.5}, {"theta": FAR}, {"theta": MANY, "signals": np.zeros((9000, 30))}),
        *({"seeds": seeds} for seeds in ([1], [0.5] * 9, ["1"] * 9, [True] * 9, [2**63] * 9)),
        *({"seeds": np.ma.masked_equal(SEEDS, 3)}, {"seeds": [[1], *SEEDS[1:]]}),
        *({"errors": ["cold"]}, {"errors": ["cold", *[""] * 8]}),
    ],
    "emulate": [
        *({"outputs": GOOD[:7]}, {"outputs": GOOD[:, 0]}, {"outputs": np.full((9, 30), np.nan)}),
        *({"scale": np.ones(3)}, {"scale": np.zeros(30)}, {"theta": FAR}),
    ],
    "Program": [
        *({"command": given} for given in ("", "model 'a", "model {a", ["model"])),
        *({"write": "a = {a"}, {"write": 3}, {"read": "out"}, {"keep": 3}),
        ("command", {"write": "a = {a}", "command": "model {a}"}),
    ],
    "SimulationBank": [{"path": path} for path in (5, None, "")],
    "SimulationBank.simulations": [{"identity": "other"}],
    "BatchSimulator": [
        *({"together": 0}, {"together": 2.5}, {"together": "four"}, {"time_limit": 3.0}),
        *({"neutral": 3}, {"neutral": "drag"}, {"neutral": ["drag"]}),
    ],
    "Compute": [{"batch": 0}, {"batch": 2.0}, {"timeout": -1.0}, {"timeout": np.inf}],
    "open_compute": [{"batch": 0}, {"timeout": -1.0}, {"executor": 3}, {"bank": 3}, {"bank": ""}],
    "jobs": [("seed", {"seeds": [seed]}) for seed in (2**31, np.uint64(2**63), 1.0, True, None)],
    "for_engine": [{"together": 4, "vectorised": False}],
    "for_engine, wrapped": [
        *({"together": 4}, {"time_limit": max}, {"vectorised": False}),
    ],
    "DiscrepancyFamily": [
        *({"threshold": "nonsense"}, {"threshold": np.nan}, {"threshold": Quantile(1.5)}),
        *({"threshold": Predicted(0.0)}, {"threshold": Matched(0.0)}),
        *({"transform": "cube"}, {"discrepancy": 3.0}),
    ],
    "shared_design": [
        *({"n": 10**6}, {"n": 2}, {"prior": 3}, {"batch": 0}, {"timeout": 0}, {"progress": None}),
        *((name, {"options": {name: 4}}) for name in ("nosie", "seed", "batch", "earlier")),
        *({"executor": 3}, ("chain", {"sampling": {"chain": 2}})),
    ],
    "coverage": [{"levels": 0.9}, {"levels": [0.5, 1.0]}, {"levels": []}, {"alpha": 0}],
    "sbc": [{"quantities": {"b": 3}}, {"quantities": [np.mean]}, {"alpha": 1.0}],
    "FitPipeline": [
        *({"options": {"budget": 3}}, {"sampling": {"draw": 3}}, {"prior": "flat"}, {"budget": -2}),
        *(
            {"simulate": 3},
            ("nosie", {"options": {"nosie": 1}}),
            ("seed", {"sampling": {"seed": 2}}),
        ),
    ],
    "LowerConfidenceBound": [{"jitter": 0.0}, {"jitter": np.inf}, {"jitter": "small"}],
    "PosteriorDraws": [{"share": 1.5}, {"share": None}, {"share": np.nan}],
    "CautiousDraws": [{"share": -0.1}, {"share": None}, {"share": np.nan}],
}


MORE = {
    "BatchSimulator": (BatchSimulator, {"simulate": simulate}),
    "Compute": (Compute, {}),
    "open_compute": (lambda **given: open_compute(**given).__enter__(), {}),
    "jobs": (jobs, {"theta": {}, "seeds": []}),
    "for_engine": (for_engine, {"simulate": simulate}),
    "Prior of one": (inference.Prior, {}),
    "for_engine, wrapped": (for_engine, {"simulate": BatchSimulator(simulate)}),
    "fit, log likelihood": (
        inference.fit,
        {"simulate": simulate, "prior": PRIOR, "surrogate": "log_likelihood", "progress": False},
    ),
}
"""What users reach by the names of rooms, or by other arguments."""


def refusal(call, given, argument, got=""):
    """What is wrong with how a call is refused; "" where it names the argument and what came."""
    CALLS.clear()
    try:
        call(**given)
    except (ValueError, TypeError) as error:
        told = str(error)
        named = re.search(rf"\b{argument}\b", told) and got in told
        return "" if named and not CALLS else f"{told} ({len(CALLS)} calls)"
    return "it is taken"


def test_every_public_operation_has_a_case(cases):
    assert set(cases) == set(OPERATIONS)
    assert {"fit", "Prior.sample", "Fit.sample", "sbc"} <= set(OPERATIONS)  # none went unnoticed


@pytest.mark.slow
def test_each_case_works_with_what_it_is_given(cases):
    """Else it might be refused for another reason."""
    for name, (call, good) in cases.items():
        if name != "Bolfi.tell":
            call(**good)


def test_what_makes_no_sense_is_refused_by_the_name_of_its_argument(cases):
    wrong, seen = {}, []
    for name, operation in OPERATIONS.items():
        call, good = cases[name]
        for argument in inspect.signature(operation).parameters.values():
            if argument.name == "self":
                continue
            more = argument.kind is argument.VAR_KEYWORD
            named = "nonsense" if more else argument.name
            found = refusal(call, {**good, named: Wrong()}, named, "" if more else "<Wrong>")
            seen.append((name, argument.name))
            if found:
                wrong[name, argument.name] = found
    assert not wrong
    assert {("fit", "budget"), ("Fit.sample", "draws"), ("fit", "options")} <= set(seen)


@pytest.mark.parametrize("name", [*VALUES])
def test_a_value_out_of_range_is_refused_by_its_argument(cases, name):
    """The argument that is to be named comes first in each row."""
    call, good = (cases | MORE)[name]
    wrong = []
    for row in VALUES[name]:
        argument, given = row if isinstance(row, tuple) else (next(iter(row)), row)
        found = refusal(call, good | given, argument)
        wrong += [(row, found)] if found else []
    assert not wrong


@pytest.mark.parametrize(
    ("name", "given", "told"),
    [
        ("Prior", {"distributions": {"seed": dist.Uniform(0.0, 1.0)}}, "choose another name"),
        ("Prior", {"distributions": {"a": dist.Uniform(1.0, 0.0)}}, r"got Uniform\(.*; exchange"),
        ("Prior.to_array", {"theta": {"a": np.zeros((2, 2))}}, r"got \{'a': \(2, 2\)\}"),
        ("Prior.from_unit", {"u": np.zeros((4, 2))}, r"quantile .* got \(4, 2\)"),
        ("Bolfi.tell", {"seeds": [1]}, r"got \(1,\): \[1\]"),
        ("Bolfi.tell", {"seeds": np.ma.masked_equal(SEEDS, 3)}, "leave those runs out"),
        ("fit", {"noise": "loud"}, 'number, an array, a function of the mean or "poisson"'),
        ("fit_losses", {"n": 3}, r"^give exactly one of noise=.* n=3$"),
    ],
)
def test_a_refusal_says_what_came_and_what_to_do(cases, name, given, told):
    call, good = cases[name]
    with pytest.raises(ValueError, match=told):
        call(**good | given)


def test_a_bank_is_refused_with_what_it_may_be(cases):
    call, good = cases["fit"]
    due = r"^bank must be the path of a file or a SimulationBank, got "
    for wrong in (3, "", b"runs.sqlite"):
        with pytest.raises(ValueError, match=due):
            call(**good, bank=wrong)


def test_a_pool_that_forks_is_refused(cases):
    call, good = cases["fit"]
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("fork")) as pool:
        assert refusal(call, good | {"executor": pool}, "executor") == ""


def test_an_executor_that_is_no_pool_of_processes_may_hold_what_it_likes():
    class Other(ThreadPoolExecutor):
        _mp_context = multiprocessing.get_context("fork")

    with Other(1) as pool, open_compute(executor=pool) as compute:
        assert compute.executor is pool


def test_a_simulator_of_one_thread_takes_no_pool_of_threads():
    with ThreadPoolExecutor(1) as pool:
        assert refusal(*MORE["open_compute"], "executor") == "it is taken"
        alone = partial(MORE["open_compute"][0], one_thread=True)
        assert refusal(alone, {"executor": pool}, "executor") == ""


def test_what_keeps_results_needs_the_simulators_name(cases, tmp_path):
    """Else a mended simulator is given the runs of the one before."""
    call, good = cases["fit"]
    told = "^identity must name the simulator and its version where (bank|store)= keeps"
    with inference.SimulationBank(tmp_path / "a.sqlite") as bank:
        for kept in (tmp_path / "b.sqlite", str(tmp_path / "b.sqlite"), bank):
            with pytest.raises(ValueError, match=told):
                call(**good, bank=kept)
        with pytest.raises(ValueError, match=told):
            run_missing(len, [], Compute(bank=bank))
    with inference.SimulationBank() as bank:
        call(**good, bank=bank)
    with pytest.raises(ValueError, match=told):
        inference.FitPipeline(len, good["prior"], options={"bank": tmp_path / "b.sqlite"})
    with pytest.raises(ValueError, match=told):
        inference.replicates(print, len, good["prior"], 2, store=tmp_path / "b.sqlite")
    data = criticism.Experiment(len, OBSERVED, criticism.KnownNoise(1.0), "named")
    with pytest.raises(ValueError, match=told):
        criticism.criticise(
            data,
            good["prior"],
            {},
            held_out=[criticism.Experiment(len, OBSERVED + 1.0, data.noise)],
            bank=tmp_path / "b.sqlite",
        )


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"budgt": 10}, "do you mean budget"),
        ({"compnents": 3}, "do you mean components"),
        ({"surrogate": "discrepancy", "components": 3}, r"of the surrogate \['signal'\]"),
    ],
)
def test_a_misspelt_or_misplaced_argument_is_met_with_the_right_one(cases, given, told):
    call, good = cases["fit"]
    with pytest.raises(ValueError, match=told):
        call(**good | given)
