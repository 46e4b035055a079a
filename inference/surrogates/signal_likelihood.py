"""The Gaussian likelihood of an emulated signal."""

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..gp.namespaces import log_sum_exp, namespace
from ..gp.process import GP, padded, predict
from .emulator import Emulator, Size
from .measurement_noise import Reduced
from .processes import log_success

SCORES_TOGETHER = 8  # by which the scores of padded states are counted
WALL = 0.01  # of prior quantiles, beyond a box, over which the likelihood vanishes


class SignalLikelihood(NamedTuple):
    """The likelihood: k scores, g nodes of the noise.

    Scores that only fill an array come last, have `used` 0 and count as known.
    """

    gp: GP
    used: np.ndarray  # [k], 1 or 0
    estimate: np.ndarray  # [g, k], the observed scores
    covariance: np.ndarray  # [g, k, k], their error, the simulator's noise included
    log_weight: np.ndarray  # [g]
    low: np.ndarray  # [d], ends of the box outside of which the likelihood vanishes
    high: np.ndarray
    success: GP | None = None  # see `processes.learn_success`
    doubt: np.ndarray = np.ones(())  # the part of the emulator's variance that counts
    size: Size | None = None  # of the run-to-run noise, where it depends on the parameters
    # of size 1: its share of each node's noise [g], `Reduced.unexplained` [g], and values less
    # scores; nothing without `size`
    share: np.ndarray | None = None
    unexplained: np.ndarray | None = None
    freedom: np.ndarray | None = None

    def padded(self) -> "SignalLikelihood":
        """The likelihood with a number of scores that is a multiple of SCORES_TOGETHER."""
        g, k = self.estimate.shape
        total = SCORES_TOGETHER * max(1, -(-k // SCORES_TOGETHER))
        covariance = np.tile(np.eye(total), (g, 1, 1))
        covariance[:, :k, :k] = self.covariance
        more = (0, total - k)
        return self._replace(
            gp=padded(self.gp, total),
            used=np.pad(self.used, more),
            estimate=np.pad(self.estimate, ((0, 0), more)),
            covariance=covariance,
        )

    def only(self, kept: list[int]) -> "SignalLikelihood":
        """The likelihood of some nodes."""
        names = ["estimate", "covariance", "log_weight"]
        names += [] if self.size is None else ["share", "unexplained"]
        return self._replace(**{name: getattr(self, name)[kept] for name in names})

    def __call__(self, u: Any) -> Any:
        """log P(success) sum_g w_g N(estimate_g; mu(u), covariance_g + V(u)) [n], V the emulator's
        variance.

        Bayarri et al. (2009) and Higdon et al. (2008) with the discrepancy's covariance integrated
        out over nodes.
        """
        densities = log_sum_exp(node_log_densities(self, u))
        return densities + log_success(self.success, u) - _wall(self, u)

    def known(self, u: np.ndarray, latent: np.ndarray) -> np.ndarray:
        """The log likelihood [n], were the scores at u [n, d] latent [k, n]."""
        terms = _given_scores(self, u, latent.T * self.used, np.zeros(latent.T.shape))
        return log_sum_exp(terms) + log_success(self.success, u) - _wall(self, u)

    def second_moment(self, u: np.ndarray, spread: np.ndarray | None) -> np.ndarray:
        """log E[L(u)^2], the expectation over means that vary with variance `spread` [n, ..., k].

        `spread` is the emulator's variance V (None), or that part of it which further simulations
        will resolve: N(z; m, S)^2 integrates over m ~ N(mu, T), S = C + V - T, to
        |4 pi S|^(-1/2) N(z; mu, S / 2 + T) (Surer et al. 2024). E[L^2] / E[L]^2 is taken from the
        node of largest weight at u."""
        k = len(self.used)
        mean, total = scores(self, u)
        terms = node_log_densities(self, u)
        loudest = np.argmax(terms, axis=1)
        varying = total if spread is None else spread[..., :k]
        ones = [1] * (varying.ndim - 2)  # axes of `spread` beside n and k
        left = (self.estimate[loudest] - mean).reshape(len(u), *ones, k)
        covariance = self.covariance[loudest]
        if self.size is not None:
            factor = noise_factor(self, self.size, u)[np.arange(len(u)), loudest]
            covariance = factor[:, None, None] * covariance
        covariance = covariance.reshape(len(u), *ones, k, k)
        total = total.reshape(left.shape)
        log_det, square = eliminate(_with_variances(covariance, total), left)
        rest = _with_variances(covariance, total - varying)
        of_rest = eliminate(rest, np.zeros(k))[0]
        log_det_both, square_both = eliminate(_with_variances(rest / 2.0, varying), left)
        # log N(z; mu, S / 2 + T) - log |4 pi S| / 2 - 2 log N(z; mu, C + V)
        excess = log_det - 0.5 * (log_det_both + of_rest) + square - 0.5 * square_both
        both = 2.0 * (log_sum_exp(terms) + log_success(self.success, u) - _wall(self, u))
        return both.reshape(left.shape[:-1]) + excess - 0.5 * k * np.log(2.0)


def likelihood_of(
    emulator: Emulator, reduced: Reduced, box: tuple[np.ndarray, np.ndarray] | None = None
) -> SignalLikelihood:
    """The likelihood of an emulator's components in use."""
    used, d = emulator.basis.used, emulator.gp.data.u.shape[1]
    state = SignalLikelihood(
        emulator.scores,
        np.ones(used),
        reduced.estimate,
        reduced.covariance,
        reduced.log_weight,
        *(box or (np.zeros(d), np.ones(d))),
    )
    if emulator.size is None:
        return state
    freedom = np.asarray(float(len(emulator.basis.scale) - used))
    sized = {"size": emulator.size, "share": reduced.share, "freedom": freedom}
    return state._replace(unexplained=reduced.unexplained, **sized)


def node_log_densities(state: SignalLikelihood, u: Any) -> Any:
    """The terms [n, g] of the likelihood's sum."""
    return _given_scores(state, u, *scores(state, u))


def _given_scores(state: SignalLikelihood, u: Any, mean: Any, variance: Any) -> Any:
    """The terms [n, g] at scores of means and variances [n, k]."""
    of_noise, log_weight = state.covariance, state.log_weight
    if state.size is not None:
        factor = noise_factor(state, state.size, u)
        of_noise = factor[..., None, None] * of_noise
        log_weight = log_weight - 0.5 * (
            state.freedom * namespace(u).log(factor) + state.unexplained * (1.0 / factor - 1.0)
        )
    covariance = _with_variances(of_noise, variance[:, None])
    log_det, square = eliminate(covariance, state.estimate - mean[:, None])
    constant = math.log(2.0 * math.pi) * state.used.sum()
    return log_weight - 0.5 * (constant + log_det + square)


def noise_factor(state: SignalLikelihood, size: Size, u: Any) -> Any:
    """The variance of all noise at u over that at size 1 of the run-to-run noise, [n, g].

    Exact where a node has no other noise, or next to no run-to-run noise; between the two, all of
    a node's noise keeps its shape while it grows.
    """
    spread = namespace(u).exp(2.0 * size.log(u))
    return 1.0 + state.share * (spread[:, None] - 1.0)


def scores(state: SignalLikelihood, u: Any) -> tuple[Any, Any]:
    """Means and variances [n, k] of the scores at u [n, d]; outside of the box, at its end."""
    mean, variance = predict(state.gp, namespace(u).clip(u, state.low, state.high))
    return mean.T * state.used, variance.T * state.used * state.doubt


def _wall(state: SignalLikelihood, u: Any) -> Any:
    """Penalty of the log likelihood outside of the box, Gaussian: gradients can climb it."""
    xp = namespace(u)
    outside = xp.maximum(state.low - u, 0.0) + xp.maximum(u - state.high, 0.0)
    return 0.5 * xp.sum((outside / WALL) ** 2, axis=-1)


def _with_variances(covariance: Any, variance: Any) -> Any:
    """Covariances [..., k, k] plus variances [..., k] on their diagonals."""
    return covariance + variance[..., None] * np.eye(variance.shape[-1])


def eliminate(matrix: Any, vector: Any) -> tuple[Any, Any]:
    """log |C| and v^T C^-1 v for small positive definite C [..., k, k] and v [..., k].

    NumPy: Gaussian elimination, unrolled, along all other axes at once. JAX: `_differentiable`.
    """
    if namespace(matrix) is not np:
        return _differentiable()(matrix, vector)
    log_det, square = np.zeros(matrix.shape[:-2]), np.zeros(vector.shape[:-1])
    for _ in range(matrix.shape[-1]):
        pivot, row = matrix[..., 0, 0], matrix[..., 0, 1:]
        log_det = log_det + np.log(pivot)
        square = square + vector[..., 0] ** 2 / pivot
        share = row / pivot[..., None]
        vector = vector[..., 1:] - share * vector[..., :1]
        matrix = matrix[..., 1:, 1:] - share[..., :, None] * row[..., None, :]
    return log_det, square


@cache
def _differentiable() -> Callable[[Any, Any], tuple[Any, Any]]:
    """`eliminate` for JAX's arrays, with an analytic derivative: XLA compiles half as much."""
    import jax
    from jax import numpy as jnp

    def solved(matrix: Any, vector: Any) -> tuple[Any, Any, Any]:
        """log |C|, C^-1 and C^-1 v, by the sweep operator (Goodnight 1979) as k changes of rank
        one."""
        k = matrix.shape[-1]
        scale = 1.0 / jnp.sqrt(jnp.diagonal(matrix, axis1=-2, axis2=-1))
        swept = matrix * scale[..., :, None] * scale[..., None, :]
        pivots = []
        for i in range(k):
            row = swept[..., i, :]
            pivots.append(row[..., i])
            row = row - np.eye(k)[i]
            swept = swept - row[..., :, None] * row[..., None, :] / pivots[i][..., None, None]
        log_det = jnp.log(jnp.stack(pivots)).sum(0) - 2.0 * jnp.log(scale).sum(-1)
        inverse = (2.0 * np.eye(k) - swept) * scale[..., :, None] * scale[..., None, :]
        return log_det, inverse, (inverse * vector[..., None, :]).sum(-1)

    @jax.custom_jvp
    def eliminated(matrix: Any, vector: Any) -> tuple[Any, Any]:
        log_det, _, solution = solved(matrix, vector)
        return log_det, (vector * solution).sum(-1)

    @eliminated.defjvp
    def _(at: Any, along: Any) -> Any:
        (matrix, vector), (of_matrix, of_vector) = at, along
        log_det, inverse, solution = solved(matrix, vector)
        of_log_det = (inverse * of_matrix).sum((-2, -1))
        outer = solution[..., :, None] * solution[..., None, :]
        of_square = 2.0 * (solution * of_vector).sum(-1) - (outer * of_matrix).sum((-2, -1))
        return (log_det, (vector * solution).sum(-1)), (of_log_det, of_square)

    return eliminated
