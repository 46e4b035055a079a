"""The engine as a pipeline, with simulations of its own or with a design that is shared."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..arguments import check_function, checked_integer
from ..bolfi import MIN_LEARN, Bolfi
from ..loop import fit
from ..prior import Prior
from ..simulations.bank import SimulationBank
from ..simulations.executors import Workers, open_executor
from ..simulations.job import jobs, simulation_seed, stacked
from ..simulations.runner import Keep, run_missing
from ..sobol import sobol
from ..surrogates.families import resolve
from ..types import Simulator
from .replicate import LogDensity

Options = Mapping[str, Any]


@dataclass(frozen=True)
class FitPipeline:
    """`fit` and `Fit.sample` on each set of data, with new simulations each time.

    Attributes:
        simulate, prior: See `fit`.
        budget: Simulations per set of data.
        options: Other options of `fit`, such as {"surrogate": "signal"}.
        sampling: Options of `Fit.sample`, such as {"chains": 2, "draws": 250}.
        warn: Whether a replicate's complaints are raised as warnings.
    """

    simulate: Simulator
    prior: Prior
    budget: int = 40
    options: Options = field(default_factory=dict)
    sampling: Options = field(default_factory=dict)
    warn: bool = True

    def __post_init__(self) -> None:
        """Raise ValueError where every replicate would."""
        check_function("simulate", self.simulate)
        checked_integer("budget", self.budget, MIN_LEARN)
        loop = signature(fit).parameters
        of_family = {name: value for name, value in self.options.items() if name not in loop}
        resolve(self.options.get("surrogate"), of_family)

    def __call__(self, observed: np.ndarray, seed: int) -> tuple[xr.DataTree, LogDensity]:
        options = {"progress": False, "warn": self.warn, **self.options}
        made = fit(self.simulate, self.prior, observed, budget=self.budget, seed=seed, **options)
        sampling = {"warn": self.warn, **self.sampling}
        return made.sample(seed=seed, **sampling), made.log_prob


@dataclass(frozen=True, repr=False)
class SharedDesign:
    """One set of simulations that serves every set of data; see `shared_design`.

    Attributes:
        simulate: Makes the data of the replicates; the design is made already.
        prior: The parameters and their priors.
        theta: Parameters of the simulations [n, d], natural units.
        signals: [n, *signal_shape]; rows of NaN where a simulation failed.
        seeds: [n].
        options: Options of `Bolfi`, such as {"surrogate": "signal"}.
        sampling: Options of `Fit.sample`.
        warn: Whether a replicate's complaints are raised as warnings.
    """

    simulate: Simulator
    prior: Prior
    theta: np.ndarray
    signals: np.ndarray
    seeds: np.ndarray
    options: Options = field(default_factory=dict)
    sampling: Options = field(default_factory=dict)
    warn: bool = True

    def __repr__(self) -> str:
        n, *shape = self.signals.shape
        return f"SharedDesign({self.prior}, {n} simulations of shape {tuple(shape)})"

    def __call__(self, observed: np.ndarray, seed: int) -> tuple[xr.DataTree, LogDensity]:
        engine = Bolfi(self.prior, observed, seed=seed, **self.options)
        engine.tell(self.prior.to_dict(self.theta), self.signals, self.seeds)
        made = engine.fit(warn=self.warn)
        sampling = {"warn": self.warn, **self.sampling}
        return made.sample(seed=seed, **sampling), made.log_prob


def shared_design(  # noqa: PLR0913  one flat place for what defines a design
    simulate: Simulator,
    prior: Prior,
    n: int = 40,
    *,
    seed: int = 0,
    options: Options | None = None,
    sampling: Options | None = None,
    executor: Workers | None = None,
    bank: str | Path = ":memory:",
    identity: str = "",
    warn: bool = True,
) -> SharedDesign:
    """A pipeline whose n simulations are made here, once, for all replicates.

    The points fill the prior (scrambled Sobol) instead of following an acquisition, which
    depends on the data. What is checked is then this one emulator, averaged over data: many
    replicates cost n simulations and one for each set of data.

    Args:
        simulate, prior, executor, bank, identity: See `fit`.
        n: Simulations, at least three.
        seed: Fixes the points and the simulations' seeds.
        options: Of `Bolfi`, such as {"surrogate": "signal"}.
        sampling: Of `Fit.sample`, such as {"chains": 2, "draws": 250}.
        warn: Whether a replicate's complaints are raised as warnings.

    Raises:
        RuntimeError: fewer than three simulations succeeded.
    """
    n, seed = checked_integer("n", n, MIN_LEARN), checked_integer("seed", seed, 0)
    theta = prior.from_unit(sobol(seed, 0, n, len(prior)))
    seeds = [simulation_seed(seed, i) for i in range(n)]
    with SimulationBank(bank) as kept, open_executor(executor) as workers:
        keep = Keep(kept, identity, executor=workers)
        made = run_missing(simulate, jobs(theta, seeds), keep)
    good = sum(result.signal is not None for result in made)
    if good < MIN_LEARN:
        first = next((result.error for result in made if result.error), "none")
        raise RuntimeError(
            f"{good} of {n} simulations succeeded, {MIN_LEARN} are needed; the first error: {first}"
        )
    return SharedDesign(
        simulate,
        prior,
        prior.to_array(theta),
        stacked(made),
        np.array(seeds),
        options or {},
        sampling or {},
        warn,
    )
