"""Probability that a simulation succeeds, by kernel regression."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._float64 import in_float64

KERNEL_WIDTH = 0.1  # in prior quantiles
PRIOR_SUCCESSES = 0.05  # successes that are assumed everywhere


class Feasibility(NamedTuple):
    """Runs so far, on arrays of a fixed shape."""

    u: jax.Array  # [p, d]
    succeeded: jax.Array  # [p], 1 or 0; 0 where not in use
    failed: jax.Array  # [p], 1 or 0; 0 where not in use


@in_float64
def feasibility(u: np.ndarray, succeeded: np.ndarray, rows: int) -> Feasibility:
    """u [n, d], succeeded bool [n]."""
    extra = rows - len(u)
    good = np.pad(succeeded.astype(float), (0, extra))
    bad = np.pad((~succeeded).astype(float), (0, extra))
    return Feasibility(
        jnp.asarray(np.pad(u, ((0, extra), (0, 0)))), jnp.asarray(good), jnp.asarray(bad)
    )


def log_feasible(runs: Feasibility, u: jax.Array) -> jax.Array:
    """Log of the share of successes around u [d] (Nadaraya and Watson); 0 if nothing failed."""
    near = jnp.exp(-0.5 * jnp.sum(((runs.u - u) / KERNEL_WIDTH) ** 2, -1))
    good, bad = near @ runs.succeeded + PRIOR_SUCCESSES, near @ runs.failed
    return jnp.log(good) - jnp.log(good + bad)
