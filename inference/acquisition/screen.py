"""A quick population of candidate points: importance sampling that zooms in.

Cheaper and coarser than `sampling.importance`, for choosing where to simulate, not for sampling:
an even screen of the prior, then rounds of a Gaussian kernel around resampled points, tempered
while the target is too narrow for it (population Monte Carlo, Cappe et al. 2004).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import ndtr, ndtri

from ..gp.namespaces import log_sum_exp
from ..sampling.target import log_prior
from ..sobol import sobol

ROUND_POINTS = 64
EVEN_ROUNDS, ROUNDS = 4, 8  # rounds that fill the prior evenly, and rounds in all
CENTRES = 32
MIN_EFFECTIVE = 24.0  # points to which the target is tempered
KERNEL_WIDTH = 0.5  # of the kernel, in the population's sds
PRIOR_SHARE = 0.1
BOX_EDGE = 1e-9
LOG_POWERS = np.linspace(-20.0, 0.0, 21)  # logs of the inverse temperatures tried


class Screen(NamedTuple):
    """Points u [n, d], log target and log weights [n]."""

    u: np.ndarray
    log_target: np.ndarray
    log_weights: np.ndarray


class _Kernel(NamedTuple):
    centres: np.ndarray  # [CENTRES, d]
    factor: np.ndarray  # [d, d], lower Cholesky factor of the covariance

    def propose(self, uniforms: np.ndarray) -> np.ndarray:
        """Draws x [n, d] made from uniforms [n, d + 1]."""
        z, choice = ndtri(uniforms[:, :-1]), uniforms[:, -1]
        within = (choice - PRIOR_SHARE) / (1.0 - PRIOR_SHARE)
        centre = self.centres[np.clip((within * CENTRES).astype(int), 0, CENTRES - 1)]
        return np.where(choice[:, None] < PRIOR_SHARE, z, centre + z @ self.factor.T)

    def log_density(self, x: np.ndarray) -> np.ndarray:
        """Log density of a round's proposals at x [n, d]."""
        apart = (x[:, None, :] - self.centres).reshape(-1, x.shape[1])
        white = solve_triangular(self.factor, apart.T, lower=True).T
        each = log_prior(white).reshape(len(x), -1) - np.log(np.diag(self.factor)).sum()
        fitted = np.log1p(-PRIOR_SHARE) + log_sum_exp(each) - np.log(CENTRES)
        return np.logaddexp(fitted, np.log(PRIOR_SHARE) + log_prior(x))


def screen(shifts: np.ndarray, log_target: Callable[[np.ndarray], np.ndarray]) -> Screen:
    """Weighted points for exp(log_target(u)) over the unit box, fixed in number.

    Args:
        shifts: Uniform random numbers [ROUNDS, d + 1] that shift the Sobol points.
        log_target: u [n, d] -> [n]; what is not finite counts as -inf.
    """
    d = shifts.shape[1] - 1
    even = (sobol(0, 0, ROUND_POINTS * EVEN_ROUNDS, d) + shifts[0, :d]) % 1.0
    cloud = sobol(1, 0, ROUND_POINTS, d + 1)
    x = ndtri(np.clip(even, BOX_EDGE, 1.0 - BOX_EDGE))
    values = _finite(log_target(ndtr(x)))
    # points are charged with the kernel that proposed them and with later ones, not with earlier
    # ones: cheap, and enough for choosing
    mass = np.log(len(x)) + log_prior(x)
    for shift in shifts[EVEN_ROUNDS:]:
        kernel = _fit(x, values, mass)
        new = kernel.propose(np.clip((cloud + shift) % 1.0, BOX_EDGE, 1.0 - BOX_EDGE))
        x = np.concatenate([x, new])
        values = np.concatenate([values, _finite(log_target(ndtr(new)))])
        mass = np.append(mass, np.full(len(new), -np.inf))
        mass = np.logaddexp(mass, np.log(ROUND_POINTS) + kernel.log_density(x))
    return Screen(ndtr(x), values, _log_weights(x, values, mass, np.ones(1))[0])


def _finite(values: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(values), values, -np.inf)


def _log_weights(
    x: np.ndarray, values: np.ndarray, mass: np.ndarray, power: np.ndarray
) -> np.ndarray:
    """Log weights [m, n] for targets raised to powers [m]."""
    return power[:, None] * values + log_prior(x) - mass


def _fit(x: np.ndarray, values: np.ndarray, mass: np.ndarray) -> _Kernel:
    """A kernel for the target raised to the largest power that leaves enough effective points."""
    tried = _log_weights(x, values, mass, np.exp(LOG_POWERS))
    if not np.isfinite(values).any():
        tried = np.tile(log_prior(x) - mass, (len(LOG_POWERS), 1))
    effective = np.exp(2.0 * log_sum_exp(tried) - log_sum_exp(2.0 * tried))
    enough = np.flatnonzero(effective >= MIN_EFFECTIVE)
    log_weights = tried[enough[-1] if len(enough) else 0]
    weights = np.exp(log_weights - log_weights.max())
    total = np.cumsum(weights)
    positions = (np.arange(CENTRES) + 0.5) / CENTRES * total[-1]
    centres = x[np.minimum(np.searchsorted(total, positions), len(x) - 1)]
    share = weights / total[-1]
    centred = x - share @ x
    covariance = (centred * share[:, None]).T @ centred
    covariance += np.diag(1e-4 * np.diag(covariance) + 1e-12)
    return _Kernel(centres, KERNEL_WIDTH * np.linalg.cholesky(covariance))
