"""Dispatch between NumPy and JAX. NUTS traces the likelihood; all else is NumPy."""

import math
from typing import Any

import numpy as np
from scipy import special

TAIL_Z = -30.0  # below, Phi is taken from its asymptotic series, exact to 1e-10


def namespace(array: Any) -> Any:
    """NumPy or jax.numpy, whichever made the array."""
    return array.__array_namespace__()


def log_sum_exp(a: Any) -> Any:
    """Over the last axis; -inf where all of it is."""
    xp = namespace(a)
    top = xp.max(a, axis=-1, keepdims=True)
    top = xp.where(xp.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        return top[..., 0] + xp.log(xp.sum(xp.exp(a - top), axis=-1))


def ndtr(x: Any) -> Any:
    """Standard normal distribution function, to an absolute 1e-16."""
    if isinstance(x, np.ndarray | np.generic):
        return special.ndtr(x)
    import jax

    # jax's ndtr, exact to a relative 1e-16 in the tails, compiles to many times the instructions
    return 0.5 * (1.0 + jax.lax.erf(x * math.sqrt(0.5)))


def ndtri(u: Any) -> Any:
    """The inverse of `ndtr`."""
    if isinstance(u, np.ndarray | np.generic):
        return special.ndtri(u)
    from jax.scipy.special import ndtri as traced

    return traced(u)


def log_ndtr(z: Any) -> Any:
    """log Phi(z), with value and slope finite where Phi underflows."""
    if isinstance(z, np.ndarray | np.generic):
        return special.log_ndtr(z)
    import jax
    import jax.numpy as jnp

    # each branch is finite where it is not used, lest its slope be not a number
    near, far = jnp.maximum(z, TAIL_Z), jnp.minimum(z, TAIL_Z)
    inverse_square = (1.0 / far) ** 2
    series = 1.0 - inverse_square * (1.0 - inverse_square * (3.0 - 15.0 * inverse_square))
    tail = -0.5 * far**2 - jnp.log(-far) - 0.5 * math.log(2.0 * math.pi) + jnp.log(series)
    centre = jnp.log(0.5 * jax.lax.erfc(-near * math.sqrt(0.5)))
    return jnp.where(z > TAIL_Z, centre, tail)
