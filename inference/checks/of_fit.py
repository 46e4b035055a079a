"""Checks of the pipeline that made a fit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..criticism.measurement_noise import Noise, samples
from ..criticism.of_fit import noise_of, recipe_of
from ..result import Fit
from .finished_replicates import Judged
from .intervals import Coverage, coverage
from .many_replicates import replicates
from .one_replicate import Observe
from .pipelines import FitPipeline
from .random_points import Tarp, tarp
from .uniformity import SBC, sbc


@dataclass(frozen=True, repr=False, eq=False)
class FitCheck(Judged):
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
        how: Other arguments of `replicates`, such as `store`, `executor` or `seed`.

    Raises:
        ValueError: the fit has no recipe or no data, its noise cannot be drawn, or an argument is
            bad.
    """
    recipe = recipe_of(fit)
    if observe is None:
        estimated = getattr(recipe.options["surrogate"], "noise", None) is None
        noise = None if estimated else noise_of(fit)
        if noise is None and not estimated:
            raise ValueError(
                "no draws can be made of the noise that the fit was given; give observe=, which "
                "adds it: (signal, rng) -> observed"
            )
        observe = LikeObserved(np.isfinite(fit.observed), noise)
    given = recipe.simulate, fit.prior, recipe.budget, recipe.options, sampling or {}
    pipeline = FitPipeline(*given, warn=False)
    made = replicates(pipeline, n=n, observe=observe, **how)
    return FitCheck(sbc(made), coverage(made), tarp(made))
