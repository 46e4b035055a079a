"""How much of an emulated output's variance each parameter makes, under the prior."""

from typing import TYPE_CHECKING

import numpy as np

from ._lazy import stats, xr
from .arguments import require
from .prior import Prior
from .sampling.target import BATCH
from .sobol import sobol
from .surrogates.base import Surrogate

if TYPE_CHECKING:
    import xarray

MIN_VARIANCE = 1e-24  # of a value, over its squared size: less is rounding


def sobol_indices(prior: Prior, learned: Surrogate, n: int, seed: int) -> "xarray.Dataset":
    """See `Fit.sobol`."""
    due = "have independent parameters for Sobol indices"
    require(prior.model is None, "prior", due, prior)
    d = len(prior)
    points = sobol(seed, 0, n, 2 * d)
    one, other = points[:, :d], points[:, d:]
    mixed = np.repeat(one[None], d, axis=0)  # the first design, with one column of the second each
    mixed[np.arange(d), :, np.arange(d)] = other.T
    first, second = _means(learned, one), _means(learned, other)
    crossed = np.stack([_means(learned, design) for design in mixed])
    both = np.concatenate([first, second])
    variance = both.var(0)
    varies = variance > MIN_VARIANCE * np.square(both).max(0)
    if not varies.any():
        raise ValueError(
            "no value of the emulated output varies with the parameters: look at Fit.warnings, and "
            "simulate more, or with a wider prior"
        )
    found = stats.sobol_indices(
        func={"f_A": first.T, "f_B": second.T, "f_AB": np.moveaxis(crossed, 2, 1)}, n=n
    )
    columns: dict[str, tuple[tuple[str, ...], np.ndarray]] = {}
    for name, indices in (("first", found.first_order), ("total", found.total_order)):
        by_value = np.where(varies[:, None], indices.reshape(-1, d), np.nan)
        shared = variance[varies] @ by_value[varies] / variance[varies].sum()
        placed = next(iter(learned.placed(by_value.T).values()))
        axes = (f"signal_dim_{i}" for i in range(placed.ndim - 1))
        columns[name] = ("parameter", *axes), placed
        columns[f"{name}_of_all"] = ("parameter",), shared
    return xr.Dataset(columns, coords={"parameter": list(prior.names)})


def _means(learned: Surrogate, u: np.ndarray) -> np.ndarray:
    """The emulator's means [n, m] at u [n, d]."""
    parts = [learned.predict(u[start : start + BATCH])[0] for start in range(0, len(u), BATCH)]
    return np.concatenate(parts).reshape(len(u), -1)
