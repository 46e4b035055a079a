"""Small dense linear algebra without LAPACK.

OpenBLAS lets its threads spin on triangular solves of a few dozen rows: on a machine whose
cores are busy one solve then takes 16 ms instead of 0.1 ms (measured with 32 rows). Compiled
loops of matrix-vector products have no such cliff.
"""

import jax
import jax.numpy as jnp


def inverse_cholesky(matrix: jax.Array) -> jax.Array:
    """W = L^-1 [p, p] for a positive definite matrix L L^T [p, p]; NaN if it is not."""
    p = matrix.shape[0]

    def row(i: jax.Array, inverse: jax.Array) -> jax.Array:
        # rows of W from i on are still zero, so this is row i of L up to its diagonal
        below = inverse @ matrix[i]
        pivot = jnp.sqrt(matrix[i, i] - below @ below)
        unit = (jnp.arange(p) == i).astype(matrix.dtype)
        return inverse.at[i].set((unit - below @ inverse) / pivot)

    return jax.lax.fori_loop(0, p, row, jnp.zeros_like(matrix))


@jax.custom_vjp
def log_normal_density(matrix: jax.Array, y: jax.Array) -> jax.Array:
    """log N(y; 0, matrix) without the constant -p/2 log 2 pi."""
    return _forward(matrix, y)[0]


def _forward(matrix: jax.Array, y: jax.Array) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
    inverse = inverse_cholesky(matrix)
    white = inverse @ y
    value = jnp.sum(jnp.log(jnp.diag(inverse))) - 0.5 * white @ white
    return value, (inverse, white @ inverse)


def _backward(
    residuals: tuple[jax.Array, jax.Array], cotangent: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Rasmussen and Williams (2006), eq. 5.9."""
    inverse, weights = residuals
    of_matrix = 0.5 * (jnp.outer(weights, weights) - inverse.T @ inverse)
    return cotangent * of_matrix, -cotangent * weights


log_normal_density.defvjp(_forward, _backward)
