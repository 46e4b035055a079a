"""The approximate likelihood of a threshold on the discrepancy."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import log_ndtr
from jax.scipy.stats import norm

from .gp import GP, predict
from .transform import Transform


class ThresholdState(NamedTuple):
    """What the likelihood depends on; threshold in the standardised units of the GP."""

    gp: GP
    threshold: jax.Array  # []


class Quantile(NamedTuple):
    """Threshold at the q quantile of the simulated discrepancies, 0 <= q <= 1."""

    q: float


Threshold = str | float | Quantile | None
TAIL = -30.0
RULES = ("min_mean", "min_observed")


def log_likelihood(state: ThresholdState, u: jax.Array) -> jax.Array:
    """log Phi((eps - mu(u)) / sigma(u)) at u [d], sigma^2 the variance of a new discrepancy.

    Gutmann and Corander (2016), eq. for Gaussian-process surrogates; Lopez-Guevara et al.
    (2018), inference.
    """
    mean, variance = predict(state.gp, u)
    noisy = variance + jnp.exp(2.0 * state.gp.hyper.log_noise)
    return log_cdf((state.threshold - mean) / jnp.sqrt(noisy))


@jax.custom_jvp
def log_cdf(z: jax.Array) -> jax.Array:
    """log Phi(z), with value and slope finite where Phi underflows."""
    return log_ndtr(z)


@log_cdf.defjvp
def _log_cdf_jvp(
    primals: tuple[jax.Array], tangents: tuple[jax.Array]
) -> tuple[jax.Array, jax.Array]:
    """Slope phi / Phi.

    JAX's own exponentiates a difference of two numbers near z^2 / 2: wrong by a third at
    z = -1e8, by any factor beyond. From TAIL on the asymptotic series is exact to 1e-10.
    """
    (z,), (tangent,) = primals, tangents
    value = log_cdf(z)
    near, far = jnp.maximum(z, TAIL), jnp.minimum(z, TAIL)  # each finite in its unused branch
    inverse_square = (1.0 / far) ** 2
    series = 1.0 - inverse_square * (1.0 - inverse_square * (3.0 - 15.0 * inverse_square))
    slope = jnp.where(z > TAIL, jnp.exp(norm.logpdf(near) - log_ndtr(near)), -far / series)
    return value, slope * tangent


def check_rule(rule: Threshold) -> None:
    """Raise ValueError unless `rule` is a documented threshold rule."""
    if isinstance(rule, Quantile):
        valid = 0.0 <= rule.q <= 1.0
    elif isinstance(rule, str):
        valid = rule in RULES
    else:
        valid = rule is None or np.isfinite(rule)
    if not valid:
        raise ValueError(
            f"threshold must be one of {RULES}, Quantile(q) with 0 <= q <= 1, a finite number "
            f"on the discrepancy's scale or None, got {rule!r}"
        )


def choose_threshold(
    rule: Threshold, discrepancy: np.ndarray, transform: Transform, min_mean: float
) -> float:
    """The threshold on the transformed scale.

    Args:
        rule: None or "min_mean", the minimum of the surrogate's mean over the box (Gutmann
            and Corander 2016); "min_observed", the smallest discrepancy so far; a Quantile
            of the discrepancies so far; or a number on the discrepancy's own scale.
        discrepancy: Finite values [n].
        transform: That of the surrogate.
        min_mean: Minimum of its mean, on the transformed scale.

    Raises:
        ValueError: the transform is undefined at the given number.
    """
    if rule is None or rule == "min_mean":
        return min_mean
    if rule == "min_observed":
        return float(transform(discrepancy.min()))
    if isinstance(rule, Quantile):
        return float(transform(np.quantile(discrepancy, rule.q)))
    if transform.name != "identity" and float(rule) + transform.offset <= 0:
        raise ValueError(
            f"threshold {rule} must be positive for the transform {transform.name!r}; "
            "give a positive one or transform='identity'"
        )
    return float(transform(np.asarray(float(rule))))
