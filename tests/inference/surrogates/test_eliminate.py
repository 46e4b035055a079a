"""Determinant and square of small covariances, by NumPy and, with their derivatives, by JAX."""

from functools import partial

import jax
import numpy as np
from bolfi_liquids.inference._float64 import in_float64
from bolfi_liquids.inference.surrogates.signal_likelihood import eliminate
from jax import numpy as jnp


def plain(matrix, vector):
    """The same by LAPACK, which JAX differentiates by itself."""
    solved = jnp.linalg.solve(matrix, vector[..., None])[..., 0]
    return jnp.linalg.slogdet(matrix)[1], (vector * solved).sum(-1)


def given():
    """Covariances [3, 2, 4, 4], correlated up to .99, of scales from 1e-6 to 1e3, and vectors."""
    rng, k = np.random.default_rng(0), 4
    mixed = rng.normal(size=(3, 2, k, k)) @ np.diag(np.geomspace(1.0, 0.1, k))
    scale = np.geomspace(1e-6, 1e3, k)
    covariance = (mixed @ np.swapaxes(mixed, -1, -2) + 1e-3 * np.eye(k)) * np.outer(scale, scale)
    return covariance, rng.normal(size=(3, 2, k)) * scale


@in_float64
def test_values_and_derivatives_are_those_of_lapack():
    numpys = given()
    covariance, vectors = map(jnp.asarray, numpys)

    def summed(by, matrix, vector):
        log_det, square = by(matrix, vector)
        return log_det.sum() + 0.7 * square.sum(), (log_det, square)

    (_, values), ours = jax.jit(
        jax.value_and_grad(partial(summed, eliminate), argnums=(0, 1), has_aux=True)
    )(covariance, vectors)
    (_, expected), theirs = jax.jit(
        jax.value_and_grad(partial(summed, plain), argnums=(0, 1), has_aux=True)
    )(covariance, vectors)
    for found in (values, eliminate(*numpys)):
        for one, right in zip(found, expected, strict=True):
            np.testing.assert_allclose(one, right, rtol=1e-9)
    scale = np.sqrt(np.diagonal(numpys[0], axis1=-2, axis2=-1))
    units = scale[..., :, None] * scale[..., None, :], scale
    for a, b, unit in zip(ours, theirs, units, strict=True):
        np.testing.assert_allclose(a * unit, b * unit, rtol=1e-6, atol=1e-9)
