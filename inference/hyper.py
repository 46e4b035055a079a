"""Maximum a posteriori hyperparameters of the Gaussian process."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize
from scipy.stats import norm, qmc

from .gp import Data, Hyper, log_marginal_likelihood
from .optimise import METHOD

# Normal priors of the logs: inputs are prior quantiles and targets have unit variance, so one
# choice fits every parameter, unit and simulator.
LENGTH = (np.log(0.5), 0.7)  # 95 %: a tenth of the box to twice the box
AMPLITUDE = (np.log(1.0), 0.7)
NOISE = (np.log(0.1), 1.0)  # 95 %: 1 % to 70 % of the targets' sd
SCORED, REFINED = 16, 2  # starts that are evaluated, and of these the best to be optimised


def log_prior(hyper: Hyper) -> jax.Array:
    """Log density of the hyperparameters' logs, up to a constant."""
    length = jnp.sum(((hyper.log_length - LENGTH[0]) / LENGTH[1]) ** 2)
    amplitude = ((hyper.log_amplitude - AMPLITUDE[0]) / AMPLITUDE[1]) ** 2
    noise = ((hyper.log_noise - NOISE[0]) / NOISE[1]) ** 2
    return -0.5 * (length + amplitude + noise)


def unpack(vector: jax.Array) -> Hyper:
    """[d + 2] -> Hyper."""
    return Hyper(vector[:-2], vector[-2], vector[-1])


def negative_log_posterior(vector: jax.Array, data: Data) -> jax.Array:
    hyper = unpack(vector)
    return -log_marginal_likelihood(hyper, data) - log_prior(hyper)


_value_and_grad = jax.jit(jax.value_and_grad(negative_log_posterior))
_values = jax.jit(jax.vmap(negative_log_posterior, in_axes=(0, None)))


def starts(dimension: int) -> np.ndarray:
    """Fixed quasi-random draws from the priors, [SCORED, dimension + 2]."""
    mean, sd = np.array([LENGTH] * dimension + [AMPLITUDE, NOISE]).T
    uniform = qmc.Halton(dimension + 2, scramble=False).random(SCORED + 1)[1:]
    return mean + sd * norm.ppf(uniform)


def maximum_a_posteriori(data: Data) -> Hyper:
    """Best of several truncated Newton runs; a pure function of the data, so resuming agrees."""

    def objective(vector: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = _value_and_grad(vector, data)
        return float(value), np.asarray(gradient)

    candidates = starts(data.u.shape[1])
    scores = np.asarray(_values(candidates, data))
    order = np.argsort(np.where(np.isfinite(scores), scores, np.inf))[:REFINED]
    refine = partial(minimize, objective, jac=True, method=METHOD, options={"maxfun": 100})
    results = [refine(candidates[i]) for i in order]
    best = min(results, key=lambda r: r.fun if np.isfinite(r.fun) else np.inf)
    return unpack(jnp.asarray(best.x))
