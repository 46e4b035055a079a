"""A pipeline's draws, whatever they come in, and how many of them are independent."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from .._lazy import array_stats
from ..arguments import checked_array, is_table

DRAW_SPACING = 2  # autocorrelation times between kept draws: an AR(1) chain keeps exp(-4) = 0.02
MIN_DRAWS = 4  # draws per chain that an effective sample size can be estimated from


def posterior_array(drawn: Any, names: Sequence[str]) -> np.ndarray:
    """Stack posterior draws.

    Args:
        drawn: Mapping or data frame of name -> [chain, draw] or [draw], or an object with such a
            mapping as `.posterior` (DataTree, InferenceData). Other names are ignored.
        names: The parameters wanted.

    Returns:
        float64 [chain, draw, d], in the order of `names`.

    Raises:
        ValueError: a parameter is missing, or shapes are not as above and equal.
    """
    posterior = getattr(drawn, "posterior", drawn)
    if not is_table(posterior):
        raise ValueError(
            "a pipeline must return name -> draws or a tree with a posterior group, "
            f"got {type(drawn).__name__}"
        )
    missing = [name for name in names if name not in posterior]
    if missing:
        raise ValueError(
            f"the pipeline's draws must hold the parameters {tuple(names)}, "
            f"got {tuple(map(str, posterior))}"
        )
    columns = [checked_array(f"draws of {name!r}", posterior[name]) for name in names]
    shapes = {name: column.shape for name, column in zip(names, columns, strict=True)}
    if len(set(shapes.values())) > 1 or columns[0].ndim not in (1, 2) or columns[0].size == 0:
        raise ValueError(
            f"draws must all have one shape, [chain, draw] or [draw], not empty, got {shapes}"
        )
    stacked = np.stack(columns, -1)
    return stacked if stacked.ndim == 3 else stacked[None]


def effective_size(draws: np.ndarray) -> float:
    """The least effective sample size of draws [chain, draw, d], over bulk, tails and parameters.

    Rank-normalised, split chains (Vehtari et al. 2021). A parameter that never moves counts as
    one draw; chains shorter than `MIN_DRAWS` show no autocorrelation and count in full.
    """
    total = draws.shape[0] * draws.shape[1]
    if draws.shape[1] < MIN_DRAWS:
        return float(total)
    if (np.ptp(draws, axis=(0, 1)) == 0.0).any():
        return 1.0
    ess = partial(array_stats().ess, draws, chain_axis=0, draw_axis=1)
    sizes = [total, *ess(method="bulk"), *ess(method="tail", prob=(0.1, 0.9))]
    return max(1.0, float(np.nanmin(sizes)))


def thin(draws: np.ndarray, most: int, effective: float) -> np.ndarray:
    """At most `most` draws, evenly spaced and `DRAW_SPACING` autocorrelation times apart.

    Args:
        draws: [chain, draw, d].
        most: Upper limit of what is kept.
        effective: Independent draws that these are worth; infinite keeps any spacing.

    Returns:
        [m, d], m >= 1.
    """
    joined = draws.reshape(-1, draws.shape[-1])
    n = int(max(1.0, min(most, len(joined), effective / DRAW_SPACING)))
    return joined[((np.arange(n) + 0.5) * len(joined) / n).astype(int)]
