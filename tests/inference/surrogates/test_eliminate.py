"""Determinant and square of small covariances, by NumPy and, with their derivatives, by JAX."""

import jax
import numpy as np
import pytest
from bolfi_liquids.inference._float64 import in_float64
from bolfi_liquids.inference.surrogates.signal_likelihood import eliminate
from jax import numpy as jnp


def plain(matrix, vector):
    """The same by LAPACK, which JAX differentiates by itself."""
    solved = jnp.linalg.solve(matrix, vector[..., None])[..., 0]
    return jnp.linalg.slogdet(matrix)[1], (vector * solved).sum(-1)


@pytest.fixture(params=[1, 4, 8])
def given(request):
    """Covariances [3, 2, k, k], correlated up to .99, of scales from 1e-6 to 1e3, and vectors."""
    rng, k = np.random.default_rng(0), request.param
    mixed = rng.normal(size=(3, 2, k, k)) @ np.diag(np.geomspace(1.0, 0.1, k))
    scale = np.geomspace(1e-6, 1e3, k)
    covariance = (mixed @ np.swapaxes(mixed, -1, -2) + 1e-3 * np.eye(k)) * np.outer(scale, scale)
    return covariance, rng.normal(size=(3, 2, k)) * scale


@in_float64
def test_both_agree_with_lapack(given):
    expected = plain(*map(jnp.asarray, given))
    for matrix, vector in (given, map(jnp.asarray, given)):
        for found, right in zip(eliminate(matrix, vector), expected, strict=True):
            np.testing.assert_allclose(found, right, rtol=1e-9)


@in_float64
@pytest.mark.parametrize("number", [0, 1])
def test_the_derivative_is_that_of_lapack(given, number):
    ours, theirs = (
        jax.grad(lambda *at, by=by: by(*at)[number].sum(), argnums=(0, 1))(*map(jnp.asarray, given))
        for by in (eliminate, plain)
    )
    scale = np.sqrt(np.diagonal(given[0], axis1=-2, axis2=-1))
    units = scale[..., :, None] * scale[..., None, :], scale
    for a, b, unit in zip(ours, theirs, units, strict=True):
        np.testing.assert_allclose(a * unit, b * unit, rtol=1e-6, atol=1e-9)
