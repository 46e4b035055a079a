"""Checks of the pipeline that made a fit."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from inspect import signature
from typing import Any

import numpy as np

from .._lazy import xr
from ..arguments import checked_mapping
from ..criticism.measurement_noise import Noise, samples
from ..criticism.of_fit import noise_of, recipe_of
from ..prior import Prior
from ..result import Fit, Recipe
from ..types import Simulator
from .many_replicates import replicates
from .one_replicate import LogDensity, Observe
from .posterior_checks import SBC, Coverage, Tarp, Warned, coverage, sbc, tarp


@dataclass(frozen=True, repr=False, eq=False)
class FitCheck(Warned):
    """Three checks of the same replicates.

    Attributes:
        sbc: Ranks of each parameter and of the log density.
        coverage: Of central intervals.
        tarp: Of the joint posterior.
    """

    sbc: SBC
    coverage: Coverage
    tarp: Tarp

    @property
    def warnings(self) -> list[str]:
        """Warnings about the pipeline, each once."""
        parts = (self.sbc, self.coverage, self.tarp)
        return list(dict.fromkeys(warning for part in parts for warning in part.warnings))

    def __repr__(self) -> str:
        return "\n\n".join(map(str, (self.sbc, self.coverage, self.tarp)))


@dataclass(frozen=True, eq=False)
class LikeObserved:
    """Data as they were observed: with gaps in the same places, and measurement noise.

    Attributes:
        there: Which samples were observed, bool [*signal_shape].
        noise: That the simulator does not make; None adds none.
    """

    there: np.ndarray
    noise: Noise | None

    def __call__(self, signal: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Add gaps and noise to a signal [*signal_shape]."""
        gaps = np.where(self.there, 0.0, np.nan)
        if self.noise is not None:
            gaps[self.there] = self.noise.draw(rng, samples(gaps), 1)[0]
        return signal + gaps


@dataclass(frozen=True)
class Refit:
    """The pipeline that made a fit, on other data.

    Attributes:
        recipe: How it was made.
        prior: The parameters and their priors.
        sampling: Options of `Fit.sample`.
    """

    recipe: Recipe
    prior: Prior
    sampling: Mapping[str, Any]

    @property
    def simulate(self) -> Simulator:
        """The simulator, of batches."""
        return self.recipe.simulate

    def __call__(self, observed: np.ndarray, seed: int) -> "tuple[xr.DataTree, LogDensity]":
        of = self.recipe
        fit = partial(of.fit, of.simulate, self.prior, observed, budget=of.budget)
        return fit_and_sample(fit, of.options, self.sampling, seed=seed, warn=False)


def fit_and_sample(
    fit: Callable[..., Fit],
    options: Mapping[str, Any],
    sampling: Mapping[str, Any],
    *,
    seed: int,
    warn: bool,
) -> "tuple[xr.DataTree, LogDensity]":
    """Draws and density of a pipeline; `warn` holds where options and sampling say nothing."""
    made = fit(seed=seed, **{"progress": False, "warn": warn, **options})
    return made.sample(seed=seed, **{"warn": warn, **sampling}), made.log_prob


def check_sampling(options: Mapping[str, Any]) -> None:
    """Raise ValueError for options that `Fit.sample` refuses."""
    allowed = set(signature(Fit.sample).parameters) - {"self", "seed"}
    if wrong := set(checked_mapping("sampling", options, "values")) - allowed:
        raise ValueError(f"sampling must be among {sorted(allowed)}, got {sorted(wrong)}")


def check_fit(
    fit: Fit,
    n: int = 200,
    *,
    sampling: Mapping[str, Any] | None = None,
    observe: Observe | None = None,
    **how: Any,
) -> FitCheck:
    """Check the pipeline that made a fit on n data sets of known truth, see `replicates`.

    Args:
        fit: What `fit` returned.
        n: Data sets, each simulated from a draw of the prior.
        sampling: Options of `Fit.sample`.
        observe: Adds to a signal what measuring adds; None adds the gaps of these data and the
            noise that the fit was given. Noise that it estimated is the simulator's own then.
        how: Other arguments of `replicates`, such as `store`, `executor` or `seed`; `identity` is
            the fit's, unless given.

    Raises:
        ValueError: the fit has no recipe or no data, its noise cannot be drawn, or an argument is
            bad.
    """
    recipe = recipe_of(fit)
    if observe is None:
        estimated = getattr(fit.family, "noise", None) is None
        noise = None if estimated else noise_of(fit)
        if noise is None and not estimated:
            raise ValueError(
                "no draws can be made of the noise that the fit was given; give observe=, which "
                "adds it: (signal, rng) -> observed"
            )
        observe = LikeObserved(np.isfinite(fit.observed), noise)
    check_sampling(sampling or {})
    pipeline, how = Refit(recipe, fit.prior, sampling or {}), {"identity": recipe.identity} | how
    made = replicates(pipeline, n=n, observe=observe, **how)
    return FitCheck(sbc(made), coverage(made), tarp(made))
