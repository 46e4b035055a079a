"""The approximate likelihood of a threshold on the discrepancy."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import log_ndtr, logsumexp
from jax.scipy.stats import norm
from scipy.special import ndtri

from ..gp.process import GP, predict
from .transform import Transform


class ThresholdState(NamedTuple):
    """What the likelihood depends on; threshold in the standardised units of the GP."""

    gp: GP  # k processes, one for each draw of the hyperparameters
    threshold: jax.Array  # []


class Quantile(NamedTuple):
    """Threshold at the q quantile of the simulated discrepancies, 0 <= q <= 1."""

    q: float


class Predicted(NamedTuple):
    """Threshold at the q quantile of a new discrepancy where the surrogate expects least of it
    among the simulated points, 0 < q < 1."""

    q: float


Threshold = str | float | Quantile | Predicted | None
TAIL_Z = -30.0
RULES = ("min_mean", "min_observed")
DEFAULT_THRESHOLD = Predicted(0.2)
NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(12)
LEGENDRE = np.polynomial.legendre.leggauss(12)
SERIES_Z = -4.0


def log_likelihood(state: ThresholdState, u: jax.Array) -> jax.Array:
    """log Phi((eps - mu(u)) / sigma(u)) at u [d], sigma^2 the variance of a new discrepancy.

    Gutmann and Corander (2016), eq. for Gaussian-process surrogates; Lopez-Guevara et al.
    (2018), inference. The mean over the processes, where there are several.
    """
    z, _ = _standardised(state, u)
    return logsumexp(log_cdf(z)) - jnp.log(z.shape[0])


def _standardised(state: ThresholdState, u: jax.Array) -> tuple[jax.Array, jax.Array]:
    """(eps - mu) / sigma and sigma^2, [k] each."""
    mean, variance = predict(state.gp, u)
    noisy = variance + jnp.exp(2.0 * state.gp.hyper.log_noise)
    return (state.threshold - mean) / jnp.sqrt(noisy), noisy


def log_second_moment(state: ThresholdState, u: jax.Array, spread: jax.Array | None) -> jax.Array:
    """log E[L(u)^2], the expectation over a latent mean that varies with variance `spread` [k].

    `spread` is the latent variance now (None), which gives the second moment of the unknown
    likelihood (Jarvenpaa et al. 2019, MaxVar), or that part of it which further simulations
    will resolve (their expected integrated variance). Both are the chance that two variables
    of correlation r = spread / sigma^2 lie below z: Phi(z) - 2 T(z, sqrt((1 - r) / (1 + r))),
    Owen's T by Gauss and Legendre; below SERIES_Z, where that cancels,
    E_w[Phi((z + sqrt(r) w) / sqrt(1 - r))^2] by Gauss and Hermite about the integrand's peak.
    """
    z, noisy = _standardised(state, u)
    latent = noisy - jnp.exp(2.0 * state.gp.hyper.log_noise)
    r = jnp.clip((latent if spread is None else spread) / noisy, 1e-12, 1.0 - 1e-6)[:, None]
    z = z[:, None]
    peak = 2.0 * jnp.sqrt(r) / (1.0 + r) * jnp.maximum(-z, 0.0)
    width = jnp.where(z < 0.0, jnp.sqrt((1.0 - r) / (1.0 + r) + r), 1.0)
    w = peak + width * NODES
    inside = 2.0 * log_cdf((z + jnp.sqrt(r) * w) / jnp.sqrt(1.0 - r)) + norm.logpdf(w)
    log_terms = inside - norm.logpdf(NODES) + jnp.log(width * WEIGHTS / jnp.sqrt(2.0 * jnp.pi))
    tail = logsumexp(log_terms, axis=1)
    both = jnp.where(z[:, 0] > SERIES_Z, _log_both(z[:, 0], r[:, 0]), tail)
    return logsumexp(both) - jnp.log(z.shape[0])


def _log_both(z: jax.Array, r: jax.Array) -> jax.Array:
    """Log chance that two standard normals of correlation r lie below z, for z > SERIES_Z."""
    a = jnp.sqrt((1.0 - r) / (1.0 + r))[:, None]
    x = a * (LEGENDRE[0] + 1.0) / 2.0
    near = jnp.maximum(z, SERIES_Z)[:, None]
    integrand = jnp.exp(-0.5 * near**2 * (1.0 + x**2)) / (1.0 + x**2)
    owen = jnp.sum(LEGENDRE[1] * integrand * a / 2.0, axis=1) / (2.0 * jnp.pi)
    return jnp.log(jnp.maximum(norm.cdf(near[:, 0]) - 2.0 * owen, 1e-30))


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
    z = -1e8, by any factor beyond. From TAIL_Z on the asymptotic series is exact to 1e-10.
    """
    (z,), (tangent,) = primals, tangents
    value = log_cdf(z)
    near, far = jnp.maximum(z, TAIL_Z), jnp.minimum(z, TAIL_Z)  # each finite in its unused branch
    inverse_square = (1.0 / far) ** 2
    series = 1.0 - inverse_square * (1.0 - inverse_square * (3.0 - 15.0 * inverse_square))
    slope = jnp.where(z > TAIL_Z, jnp.exp(norm.logpdf(near) - log_ndtr(near)), -far / series)
    return value, slope * tangent


def check_rule(rule: Threshold) -> None:
    """Raise ValueError unless `rule` is a documented threshold rule."""
    if isinstance(rule, Quantile):
        valid = 0.0 <= rule.q <= 1.0
    elif isinstance(rule, Predicted):
        valid = 0.0 < rule.q < 1.0
    elif isinstance(rule, str):
        valid = rule in RULES
    else:
        valid = rule is None or (isinstance(rule, float | int | np.number) and np.isfinite(rule))
    if not valid:
        raise ValueError(
            f"threshold must be one of {RULES}, Predicted(q) with 0 < q < 1, Quantile(q) with "
            f"0 <= q <= 1, a finite number on the discrepancy's scale or None, got {rule!r}"
        )


def choose_threshold(
    rule: Threshold,
    discrepancy: np.ndarray,
    transform: Transform,
    at_minimum: Callable[[], tuple[float, float]],
) -> float:
    """The threshold on the transformed scale.

    Args:
        rule: None is DEFAULT_THRESHOLD; Predicted(q), the q quantile of a new discrepancy at the
            simulated point where the surrogate's mean is least; "min_mean", that mean, the same
            as Predicted(0.5) (Gutmann and Corander 2016); "min_observed", the smallest
            discrepancy so far; a Quantile of the discrepancies so far; or a number on the
            discrepancy's own scale.
        discrepancy: Finite values [n].
        transform: That of the surrogate.
        at_minimum: Mean and sd of a new discrepancy at that simulated point where the mean is
            least, on the transformed scale; called where the rule needs them. Elsewhere the mean
            may extrapolate below anything that a discrepancy can be.

    Raises:
        ValueError: the transform is undefined at the given number.
    """
    rule = DEFAULT_THRESHOLD if rule is None else Predicted(0.5) if rule == "min_mean" else rule
    if isinstance(rule, Predicted):
        mean, sd = at_minimum()
        return mean + sd * float(ndtri(rule.q))
    if rule == "min_observed":
        return float(transform(discrepancy.min()))
    if isinstance(rule, Quantile):
        return float(transform(np.quantile(discrepancy, rule.q)))
    number = float(rule)
    if transform.name != "identity" and number + transform.offset <= 0:
        raise ValueError(
            f"threshold {rule} must be positive for the transform {transform.name!r}; "
            "give a positive one or transform='identity'"
        )
    return float(transform(np.asarray(number)))
