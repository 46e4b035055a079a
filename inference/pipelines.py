"""The engine as a pipeline, with simulations of its own or with a design that is shared."""

from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np

from ._lazy import xr
from .arguments import (
    check_flag,
    check_function,
    check_identity,
    check_progress,
    check_text,
    checked_integer,
    checked_mapping,
)
from .bolfi import MIN_LEARN, MOST_SIMULATIONS, Bolfi
from .checks.of_fit import check_sampling, fit_and_sample
from .checks.one_replicate import LogDensity
from .loop import fit
from .prior import Prior, checked_prior
from .progress import progress_bar
from .simulations.bank import SimulationBank
from .simulations.compute import Workers, open_compute
from .simulations.job import BATCH, for_engine, jobs, simulation_seed, stacked
from .simulations.program import check_names
from .simulations.runner import run_missing
from .sobol import sobol
from .surrogates.families import check_options, resolve
from .types import Simulator, SingleSimulator

Options = Mapping[str, Any]

CALLING = "vectorised", "together", "time_limit"  # options of `fit` about its simulator
OF_PIPELINE = {"simulate", "prior", "observed", "budget", "seed"}  # what a pipeline gives itself


def _check_options(options: Options, known: Iterable[str]) -> None:
    """Raise ValueError for options of `fit` that are neither `known` nor their surrogate's."""
    names = signature(fit).parameters
    of_family = {name: value for name, value in options.items() if name not in names}
    check_options(of_family, fit)
    resolve(options.get("surrogate"), of_family)
    allowed = {*known, *of_family} - OF_PIPELINE - {"options"}
    if wrong := set(options) - allowed:
        raise ValueError(f"options must be among {sorted(allowed)}, got {sorted(wrong)}")


@dataclass(frozen=True)
class FitPipeline:
    """`fit` and `Fit.sample` on each set of data, with new simulations each time.

    Attributes:
        simulate, prior: See `fit`. With "vectorised": False among the options, `simulate` becomes
            the simulator of batches that calls the given one for each run.
        budget: Simulations per set of data; it may be 0 with "earlier" among the options.
        options: Other options of `fit`, such as {"surrogate": "signal", "timeout": 60}.
        sampling: Options of `Fit.sample`, such as {"chains": 2, "draws": 250}.
        warn: Whether a replicate's complaints are raised as warnings.

    Raises:
        ValueError: something given with which every replicate would fail.
    """

    simulate: Simulator | SingleSimulator
    prior: Prior
    budget: int = 40
    options: Options = field(default_factory=dict)
    sampling: Options = field(default_factory=dict)
    warn: bool = field(default=True, compare=False)

    def __post_init__(self) -> None:
        check_function("simulate", self.simulate)
        checked_prior(self.prior)
        check_flag("warn", self.warn)
        options = checked_mapping("options", self.options, "values")
        least = 0 if "earlier" in options else MIN_LEARN
        checked_integer("budget", self.budget, least, MOST_SIMULATIONS)
        _check_options(options, signature(fit).parameters)
        check_sampling(self.sampling)
        check_flag("options['vectorised']", options.get("vectorised", True))
        called = {name: options.pop(name) for name in CALLING if name in options}
        simulator = for_engine(self.simulate, **called)
        check_names(simulator, self.prior.names)
        named = options.get("identity") or simulator.identity
        check_identity(named, "bank", options.get("bank"))
        object.__setattr__(self, "simulate", simulator)
        object.__setattr__(self, "options", options)

    def __call__(self, observed: np.ndarray, seed: int) -> "tuple[xr.DataTree, LogDensity]":
        own = partial(fit, self.simulate, self.prior, observed, budget=self.budget)
        return fit_and_sample(own, self.options, self.sampling, seed=seed, warn=self.warn)


def shared_design(  # noqa: PLR0913  one flat place for what defines a design
    simulate: Simulator | SingleSimulator,
    prior: Prior,
    n: int = 40,
    *,
    batch: int = BATCH,
    seed: int = 0,
    options: Options | None = None,
    sampling: Options | None = None,
    executor: Workers | None = None,
    bank: str | Path | SimulationBank = ":memory:",
    identity: str = "",
    timeout: float | None = None,
    warn: bool = True,
    progress: bool | Callable[[int], object] = True,
) -> FitPipeline:
    """A pipeline whose n simulations are made here, once, and are "earlier" ones of all replicates.

    The points fill the prior (scrambled Sobol) instead of following an acquisition, which
    depends on the data. What is checked is then this one emulator, averaged over data: many
    replicates cost n simulations and one for each set of data.

    Args:
        simulate, prior, executor, bank, identity, timeout, progress: See `fit`.
        n: Simulations, at least three.
        batch: Simulations in one call, and stored together, where there is no executor.
        seed: Fixes the points and the simulations' seeds.
        options: Of `fit`, such as {"surrogate": "signal"}: of the surrogate and about `simulate`.
        sampling: Of `Fit.sample`, such as {"chains": 2, "draws": 250}.
        warn: Whether a replicate's complaints are raised as warnings.

    Raises:
        ValueError: bad argument.
        RuntimeError: fewer than three simulations succeeded, or the executor lost its workers.
        ImportError, ConnectionError: Dask is not installed, or does not answer.
    """
    n = checked_integer("n", n, MIN_LEARN, MOST_SIMULATIONS)
    options = checked_mapping("options", options, "values")
    _check_options(options, {*signature(Bolfi).parameters, *CALLING})
    pipeline = FitPipeline(simulate, prior, n, options, sampling or {}, warn)
    seed = checked_integer("seed", seed, 0)
    check_progress(progress)
    check_text("identity", identity)
    simulator = for_engine(pipeline.simulate)
    identity = identity or simulator.identity
    theta = prior.from_unit(sobol(seed, 0, n, len(prior)))
    seeds = [simulation_seed(seed, i) for i in range(n)]
    with ExitStack() as stack:
        compute = stack.enter_context(open_compute(executor, timeout, batch, bank))
        advance = stack.enter_context(progress_bar("simulations", n, shown=progress))
        asked = jobs(theta, seeds)
        made = run_missing(simulator, asked, compute, identity=identity, advance=advance)
    good = sum(result.signal is not None for result in made)
    if good < MIN_LEARN:
        first = next((result.error for result in made if result.error), "none")
        raise RuntimeError(
            f"{good} of {n} simulations succeeded, {MIN_LEARN} are needed; the first error: {first}"
        )
    told = {"earlier": (theta, stacked(made), np.array(seeds)), "confirm": 0}
    return replace(pipeline, budget=0, options={**pipeline.options, **told})
