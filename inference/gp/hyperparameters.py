"""Maximum a posteriori hyperparameters of Gaussian processes."""

import jax
import jax.numpy as jnp
import numpy as np

from .._lazy import stats
from .optimise import minimise_many
from .process import Data, Hyper, log_marginal_likelihood

# Normal priors of the logs: inputs are coordinates of the prior's sd (see
# `gp.process.coordinates`) and targets of about unit variance, so one choice fits every parameter,
# unit and simulator.
LENGTH = (np.log(1.0), 1.5)  # 95 %: a twentieth of the box to 20 times the box: no effect at all
AMPLITUDE = (np.log(1.0), 0.7)
NOISE = (np.log(0.2), 1.0)  # 95 %: 3 % of the targets' sd to more than all of it
SCORED_STARTS = 8  # starts that are evaluated
REFINED_STARTS = 2  # best of these, which are optimised


def log_prior(hyper: Hyper) -> jax.Array:
    """Log density [k] of the hyperparameters' logs, up to a constant."""
    length = jnp.sum(((hyper.log_length - LENGTH[0]) / LENGTH[1]) ** 2, -1)
    amplitude = ((hyper.log_amplitude - AMPLITUDE[0]) / AMPLITUDE[1]) ** 2
    noise = ((hyper.log_noise - NOISE[0]) / NOISE[1]) ** 2
    return -0.5 * (length + amplitude + noise)


def unpack(vectors: jax.Array) -> Hyper:
    """[k, d + 2] -> Hyper."""
    return Hyper(vectors[:, :-2], vectors[:, -2], vectors[:, -1])


def pack(hyper: Hyper) -> np.ndarray:
    """Hyper -> [k, d + 2]."""
    return np.column_stack([np.asarray(part) for part in hyper])


@jax.jit
def _value_and_grad(
    vectors: jax.Array, data: Data, wanted: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Negative log posterior density [k] of vectors [k, d + 2], and its gradients, where `wanted`.

    Processes are independent, so the gradient of their sum serves all.
    """

    def total(vectors: jax.Array) -> tuple[jax.Array, jax.Array]:
        hyper = unpack(vectors)
        values = -log_marginal_likelihood(hyper, data, wanted) - log_prior(hyper)
        return jnp.sum(values), values

    gradient, values = jax.grad(total, has_aux=True)(vectors)
    return values, gradient


def prior_moments(dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean and sd [dimension + 2] of the hyperparameters' logs."""
    mean, sd = np.array([LENGTH] * dimension + [AMPLITUDE, NOISE]).T
    return mean, sd


def starts(dimension: int) -> np.ndarray:
    """Fixed quasi-random draws from the priors, [SCORED_STARTS, dimension + 2]."""
    mean, sd = prior_moments(dimension)
    uniform = stats.qmc.Halton(dimension + 2, scramble=False).random(SCORED_STARTS + 1)[1:]
    return mean + sd * stats.norm.ppf(uniform)


def maximum_a_posteriori(data: Data, previous: Hyper | None = None) -> Hyper:
    """The best of several quasi-Newton runs for each of the k processes.

    Targets that are all zero teach nothing: there the prior's mode. A pure function of its
    arguments, so resuming agrees.

    Args:
        previous: The optimum for less data; optimisation then starts from there alone.
    """
    k, d = data.y.shape[0], data.u.shape[1]
    taught = np.atleast_1d(np.any(data.y, axis=1))

    def evaluate(vectors: np.ndarray, wanted: np.ndarray) -> tuple[jax.Array, jax.Array]:
        return _value_and_grad(vectors, data, wanted)

    def refine(start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return minimise_many(evaluate, start, taught)

    if previous is not None:
        found = refine(pack(previous))[0]
    else:
        candidates = starts(d)
        scores = np.array([evaluate(np.tile(c, (k, 1)), taught)[0] for c in candidates])
        order = np.argsort(np.where(np.isfinite(scores), scores, np.inf), axis=0)
        runs = [refine(candidates[order[i]]) for i in range(REFINED_STARTS)]
        best = np.argmin([values for _, values in runs], axis=0)
        found = np.array([found for found, _ in runs])[best, np.arange(k)]
    return unpack(jnp.asarray(np.where(taught[:, None], found, prior_moments(d)[0])))
