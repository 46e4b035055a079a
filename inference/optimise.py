"""Minimisation over the unit box."""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import numpy as np
from scipy.optimize import minimize

from .design import sobol

SCREENED, REFINED = 512, 5
EDGE = 1e-6  # the box is [EDGE, 1 - EDGE]: beyond lie only tails of unbounded priors

METHOD = "TNC"
"""Truncated Newton: plain C. SciPy's L-BFGS-B calls OpenBLAS, whose threads spin (see `linalg`)
and make it ten times slower on a busy machine; both reach the same optima here."""

Objective = Callable[[Any, jax.Array], jax.Array]
"""(state, u [d]) -> scalar; a module-level function."""


@partial(jax.jit, static_argnums=0)
def _values(objective: Objective, state: Any, u: jax.Array) -> jax.Array:
    return jax.vmap(objective, in_axes=(None, 0))(state, u)


@partial(jax.jit, static_argnums=0)
def _value_and_grad(objective: Objective, state: Any, u: jax.Array) -> tuple[jax.Array, jax.Array]:
    return jax.value_and_grad(objective, argnums=1)(state, u)


def minimise_in_box(objective: Objective, state: Any, dimension: int) -> np.ndarray:
    """Global minimiser u [dimension]: truncated Newton from the best of a Sobol screen.

    Of a fixed screen the best few points are refined, so the result is a pure function of
    objective and state.
    """

    def function(u: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = _value_and_grad(objective, state, u)
        return float(value), np.asarray(gradient)

    screen = sobol(0, 0, SCREENED, dimension)
    order = np.argsort(np.asarray(_values(objective, state, screen)))[:REFINED]
    refined = [
        minimize(
            function,
            screen[i],
            jac=True,
            method=METHOD,
            bounds=[(EDGE, 1.0 - EDGE)] * dimension,
            options={"maxfun": 60},
        )
        for i in order
    ]
    return min(refined, key=lambda result: result.fun).x
