"""The density of each observed value, given the parameters and all other values.

Leaving a value out of noise that hangs together leaves what the others say of it: the likelihood
has no factor for each value, but p(y_i | y_-i, theta) follows from the precision matrix (Buerkner,
Gabry and Vehtari 2021, "Efficient leave-one-out cross-validation for Bayesian non-factorized normal
and Student-t models", equations 7 to 9).
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, get_lapack_funcs

from ..gp.namespaces import log_sum_exp
from .measurement_noise import Layout, Nodes
from .signal_likelihood import SignalLikelihood, node_log_densities, noise_factor, scores

TOGETHER = 256  # rows that are worked on together
TRIED = 32  # rows that tell which nodes count
NEGLIGIBLE = 1e-9
MAX_LOG = 690.0  # of what exp may give: values more than 37 sds out are as bad as these
FLOOR = 1e-12  # of the variance, of a value that nothing makes noisy


class Weighed(NamedTuple):
    """The values y [m] and the components' vectors B [m, k], weighed by a noise's precision A."""

    diagonal: np.ndarray  # [m], of A
    target: np.ndarray  # A y [m]
    vectors: np.ndarray  # A B [m, k]
    inner: np.ndarray  # B^T A B [k, k]
    seen: np.ndarray  # B^T A y [k]


def covariances(
    factors: np.ndarray, white: np.ndarray, layout: Layout, nodes: Nodes
) -> Iterator[np.ndarray]:
    """F F^T + D + sigma^2 R(rho) [m, m] of one node after the other."""
    constant = factors @ factors.T + np.diag(white + FLOOR)
    together = layout.channel[:, None] == layout.channel
    lag = np.abs(layout.sample[:, None] - layout.sample)
    for sigma, rho in zip(*nodes, strict=True):
        yield constant + sigma**2 * np.where(together, rho**lag, 0.0)


def weighed(covariance: np.ndarray, vectors: np.ndarray, target: np.ndarray) -> Weighed:
    (invert,) = get_lapack_funcs(("potri",), (covariance,))
    upper = np.triu(invert(cholesky(covariance))[0])  # half as long as a general inverse
    precision = upper + np.triu(upper, 1).T
    right, seen = precision @ vectors, precision @ target
    return Weighed(np.diag(precision), seen, right, vectors.T @ right, vectors.T @ seen)


def log_conditionals(
    state: SignalLikelihood, nodes: list[Weighed], noise: np.ndarray, u: np.ndarray
) -> np.ndarray:
    """log p(y_i | y_-i, u) of standardised values [n, m], integrated over the noise's nodes.

    1 / p(y_i | y_-i) is the mean of 1 / p_g(y_i | y_-i) over nodes g as probable as y makes them.
    Nodes are left out that count for no value at some of u; an improbable one may count, where one
    value alone speaks against it.

    Args:
        state: The likelihood, of k scores and g nodes.
        nodes: Values and vectors at each of its nodes.
        noise: Covariance of the scores' run-to-run noise [k, k].
        u: Prior quantiles [n, d].
    """
    some = u[:: -(-len(u) // TRIED)]
    parts = list(_parts(state, nodes, noise, some))
    total = sum(part for _, part, _ in parts)
    kept = [g for g, part, share in parts if max((part / total).max(), share.max()) > NEGLIGIBLE]
    state, nodes = state.only(kept), [nodes[g] for g in kept]
    found = np.empty((len(u), len(nodes[0].target)))
    for start in range(0, len(u), TOGETHER):
        rows = slice(start, start + TOGETHER)
        parts = _parts(state, nodes, noise, u[rows])
        found[rows] = -np.log(sum(part for _, part, _ in parts))
    return found


def _parts(
    state: SignalLikelihood, nodes: list[Weighed], noise: np.ndarray, u: np.ndarray
) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Number of a node, share / p_g(y_i | y_-i) [n, m], and its share of the likelihood [n]."""
    terms = node_log_densities(state, u)
    mean, variance = scores(state, u)
    factors = np.ones_like(terms) if state.size is None else noise_factor(state, state.size, u)
    shares = np.exp(terms - log_sum_exp(terms)[:, None])
    for g, node in enumerate(nodes):
        factor, share = factors[:, g, None], shares[:, g]
        latent = noise + (variance / factor)[:, :, None] * np.eye(len(noise))
        own = _log_conditional(node, mean, latent, factor)
        yield g, share[:, None] * np.exp(np.minimum(-own, MAX_LOG)), share


def _log_conditional(
    node: Weighed, mean: np.ndarray, latent: np.ndarray, factor: np.ndarray
) -> np.ndarray:
    """log p(y_i | y_-i) [n, m] of y ~ N(B mean, factor (A^-1 + B latent B^T)), by Woodbury.

    Args:
        mean: [n, k]
        latent: [n, k, k]
        factor: [n, 1]
    """
    k = len(node.inner)
    share = np.linalg.solve(np.eye(k) + latent @ node.inner, latent)
    left = node.seen - mean @ node.inner
    pulled = mean + np.einsum("nab,nb->na", share, left)
    weighed_error = node.target - pulled @ node.vectors.T
    pairs = node.vectors[:, :, None] * node.vectors[:, None, :]
    explained = share.reshape(len(mean), k * k) @ pairs.reshape(len(pairs), k * k).T
    precision = node.diagonal - explained
    precision = np.maximum(precision, FLOOR * node.diagonal)
    spread = factor / precision  # the conditional variance
    return -0.5 * (np.log(2.0 * np.pi * spread) + weighed_error**2 / (precision * factor))
