"""Determinant and square of small covariances, by NumPy and, with a told derivative, by JAX."""

import jax
import numpy as np
import pytest
from bolfi_liquids.inference._float64 import in_float64
from bolfi_liquids.inference.surrogates.signal_likelihood import eliminate
from jax import numpy as jnp


def plain(matrix, vector):
    """The same by LAPACK, which JAX differentiates by itself."""
    return jnp.linalg.slogdet(matrix)[1], vector @ jnp.linalg.solve(matrix, vector)


@pytest.fixture(params=[1, 4, 8])
def given(request):
    """A covariance, correlated up to .99 and of scales from 1e-6 to 1e3, and a vector of it."""
    rng, k = np.random.default_rng(0), request.param
    mixed = rng.normal(size=(k, k)) @ np.diag(np.geomspace(1.0, 0.1, k))
    scale = np.geomspace(1e-6, 1e3, k)
    return (mixed @ mixed.T + 1e-3 * np.eye(k)) * np.outer(scale, scale), rng.normal(size=k) * scale


@in_float64
def test_both_agree_with_lapack(given):
    expected = plain(*given)
    for matrix, vector in (given, map(jnp.asarray, given)):
        np.testing.assert_allclose(eliminate(matrix, vector), expected, rtol=1e-9)


@in_float64
@pytest.mark.parametrize("number", [0, 1])
def test_the_derivative_is_that_of_lapack(given, number):
    told, own = (
        jax.grad(lambda *at, by=by: by(*at)[number], argnums=(0, 1))(*map(jnp.asarray, given))
        for by in (eliminate, plain)
    )
    scale = np.sqrt(np.diag(given[0]))
    for a, b, unit in zip(told, own, (np.outer(scale, scale), scale), strict=True):
        np.testing.assert_allclose(a * unit, b * unit, rtol=1e-6, atol=1e-9)
