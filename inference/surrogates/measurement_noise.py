"""The noise between an observed output and the simulator's mean output.

In standardised values its covariance is F F^T + D + sigma^2 R(rho): what the emulator's components
leave of the simulations (truncation, and the simulator's run-to-run noise outside them), white
noise D, and measurement noise or a misfit, an AR(1) process in each channel, of unknown sigma and
rho.
"""

from typing import NamedTuple

import numpy as np

NOISE_FACTORS = 16
CORRELATIONS = np.tanh([0.0, 0.3, 0.6, 0.9, 1.2, 1.6, 2.0, 2.5])  # of neighbouring samples
FEW_CORRELATIONS, NO_CORRELATION = np.array([0.0, 0.6, 0.95]), np.zeros(1)
STEP = 2.0 ** (1.0 / 3.0)  # from one sigma to the next
LEAST_OF_RESIDUAL = 1.0 / 8.0  # least sigma over the sd of a residual of many values
LEAST_OF_MISFIT = 1.0 / 32.0  # least sigma over the smallest expected misfit, where they are few
MOST = 2.0  # largest sigma over the larger of the two
MOST_OF_NOISE = 8.0  # the same of a few numbers' noise, whose posterior has a heavy tail
UNIT = 1e-3  # of the outputs' sd, added to the given noise: the misfit of one that is 0
ROUNDING = 1e-24  # variance in units of the outputs', up to which it is none
MIN_SIZE = 1e-4  # of a residual, in units of the outputs' sd: data are never without noise


class Remainder(NamedTuple):
    """Covariance F F^T + white 1 of what the components leave of the simulations."""

    factors: np.ndarray  # [m, NOISE_FACTORS]
    white: float

    @property
    def total(self) -> float:
        """Variance of all values together."""
        return float(np.sum(self.factors**2)) + self.white * len(self.factors)


class Layout(NamedTuple):
    """Positions of the m values: in channel `channel`, at `sample`; sorted by both."""

    channel: np.ndarray  # int [m]
    sample: np.ndarray  # int [m]


class Nodes(NamedTuple):
    """Pairs (sigma, rho); sigma 0 is no measurement noise."""

    sigma: np.ndarray  # [g]
    rho: np.ndarray  # [g]


Weighted = tuple[Nodes, np.ndarray]
"""Nodes and their log weights before anything is compared [g]."""

NO_MEASUREMENT_NOISE: Weighted = Nodes(np.zeros(1), np.zeros(1)), np.zeros(1)


class Reduced(NamedTuple):
    """Estimates of the k observed scores at each of g nodes.

    Up to a factor that no score enters, the likelihood is N(estimate; scores, covariance).
    """

    estimate: np.ndarray  # [g, k]
    covariance: np.ndarray  # [g, k, k]
    log_weight: np.ndarray  # [g]
    unexplained: np.ndarray  # [g], squared distance of the values from what scores can make
    share: np.ndarray  # [g], of the run-to-run noise in the variance of all noise


def shrunk_covariance(residuals: np.ndarray, lost: int) -> Remainder:
    """Covariance of residuals [n, m] with mean zero, shrunk towards the white one.

    Ledoit and Wolf (2004): smooth residuals keep their shape, white ones become white. Of the
    eigenvectors the largest are kept, the others are counted as white.

    Args:
        lost: Degrees of freedom that the components took from the n.
    """
    n, m = residuals.shape
    factors = np.zeros((m, NOISE_FACTORS))
    freedom = n - lost
    values, left = np.linalg.eigh(residuals @ residuals.T)
    values = np.maximum(values, 0.0)
    if freedom < 1 or not values.any():
        return Remainder(factors, 0.0)
    mean = values.sum() / freedom / m
    spread = np.sum((values / freedom) ** 2) / m - mean**2
    lengths = np.sum(residuals**2, 1)
    # what the components took makes residuals smaller, and as good as fewer
    error = (np.sum(lengths**2) / n - np.sum((values / n) ** 2)) / n / m * (n / freedom) ** 3
    intensity = float(np.clip(error / spread, 0.0, 1.0)) if spread > 0 else 1.0
    top = np.argsort(values)[::-1][:NOISE_FACTORS]
    factors[:, : len(top)] = residuals.T @ left[:, top] * np.sqrt((1.0 - intensity) / freedom)
    return Remainder(factors, max(mean - np.sum(factors**2) / m, 0.0))


def unknown_noise(miss: float, residual: float | None, series: bool) -> Weighted:
    """Nodes of noise that is not given.

    Args:
        miss: Smallest expected misfit.
        residual: Sd of what no component makes of the data, where these are many.
        series: Whether the values follow each other in time.
    """
    if residual is None:
        correlations = FEW_CORRELATIONS if series else NO_CORRELATION
        nodes = candidates(LEAST_OF_MISFIT * miss, MOST_OF_NOISE * miss, correlations)
    else:
        nodes = candidates(LEAST_OF_RESIDUAL * residual, MOST * max(residual, miss), CORRELATIONS)
    return nodes, _correlation_weights(nodes)


def misfit_beside(given: float, share: float, miss: float, series: bool) -> Weighted:
    """Nodes of a misfit beside noise that is given, none in front.

    The prior of the size is half-Cauchy in units of the noise, evenly spread where that is more.

    Args:
        given: Sd of the given noise, standardised.
        share: Prior probability of a misfit, 0 < share < 1.
        miss, series: As of `unknown_noise`.
    """
    correlations = FEW_CORRELATIONS if series else NO_CORRELATION
    nodes = candidates(LEAST_OF_MISFIT * miss, MOST * miss, correlations)
    ratio = nodes.sigma / (given + UNIT)
    slab = ratio / (1.0 + ratio**2) * np.exp(_correlation_weights(nodes))
    weights = np.append(1.0 - share, share * slab / slab.sum())
    return Nodes(*(np.append(0.0, part) for part in nodes)), np.log(weights)


def candidates(low: float, high: float, correlations: np.ndarray) -> Nodes:
    """The grid of nodes with sigmas from `low` to `high`, evenly in their logarithm."""
    count = max(int(np.ceil(np.log(high / low) / np.log(STEP))) + 1, 1)
    sigma, rho = np.meshgrid(np.geomspace(low, high, count), correlations, indexing="ij")
    return Nodes(sigma.ravel(), rho.ravel())


def _correlation_weights(nodes: Nodes) -> np.ndarray:
    """Log weights by which nodes even in arctanh(rho) stand for a prior even in rho."""
    return np.log1p(-(nodes.rho**2))


def residual_size(target: np.ndarray, vectors: np.ndarray) -> float:
    """Sd of what no combination of `vectors` [m, k] can make of `target` [m]."""
    left = target - vectors @ np.linalg.lstsq(vectors, target)[0]
    size = np.sqrt(np.sum(left**2) / max(len(target) - vectors.shape[1], 1))
    return float(max(size, MIN_SIZE))


def reduce(
    columns: tuple[np.ndarray, np.ndarray, np.ndarray],
    white: np.ndarray,
    layout: Layout,
    nodes: Nodes,
) -> Reduced:
    """Generalised least squares of the scores in use at each node.

    Args:
        columns: The components' vectors [m, k], of which the last may be zero; the observed
            values [m]; the factors F [m, q].
        white: Diagonal of D [m].
    """
    vectors, observed, factors = columns
    k, used = vectors.shape[1], int(np.any(vectors, 0).sum())
    white = white + 1e-12 * float(np.mean(vectors**2))
    white = np.where(white > ROUNDING, white, MIN_SIZE**2)  # where nothing at all is noisy
    fresh = np.diff(layout.channel, prepend=-1) != 0
    gap = np.where(fresh, 0, np.diff(layout.sample, prepend=0))
    result, log_det = whiten(
        np.column_stack([vectors, observed, factors]), white, fresh, gap, nodes
    )
    whitened = np.moveaxis(result, 1, 0)
    basis, target = whitened[:, :, :used], whitened[:, :, k : k + 1]
    factors = whitened[:, :, k + 1 :]
    inner = np.eye(factors.shape[2]) + np.swapaxes(factors, 1, 2) @ factors

    def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """a^T Sigma^-1 b, by Woodbury's identity."""
        a_factors, b_factors = (np.swapaxes(factors, 1, 2) @ x for x in (a, b))
        direct = np.swapaxes(a, 1, 2) @ b
        return direct - np.swapaxes(a_factors, 1, 2) @ np.linalg.solve(inner, b_factors)

    covariance = np.linalg.inv(product(basis, basis))
    right = product(basis, target)
    estimate = (covariance @ right)[:, :, 0]
    unexplained = product(target, target)[:, 0, 0] - np.sum(estimate * right[:, :, 0], 1)
    log_det = log_det + np.linalg.slogdet(inner)[1]
    # the estimate's own normalisation belongs to N(estimate; scores, covariance)
    log_weight = -0.5 * (log_det + unexplained - np.linalg.slogdet(covariance)[1])
    return Reduced(estimate, covariance, log_weight, unexplained, np.ones(len(nodes.sigma)))


def correlated(white: np.ndarray, layout: Layout, nodes: Nodes) -> np.ndarray:
    """Measurement noise [n, m] from standard normal numbers, a node of `nodes` for each row."""
    noise = np.empty_like(white)
    sigma, rho = nodes
    for i in range(white.shape[1]):
        fresh = i == 0 or layout.channel[i] != layout.channel[i - 1]
        decay = 0.0 if fresh else rho ** (layout.sample[i] - layout.sample[i - 1])
        before = 0.0 if fresh else noise[:, i - 1]
        noise[:, i] = decay * before + sigma * np.sqrt(1.0 - decay**2) * white[:, i]
    return noise


def whiten(
    columns: np.ndarray, white: np.ndarray, fresh: np.ndarray, gap: np.ndarray, nodes: Nodes
) -> tuple[np.ndarray, np.ndarray]:
    """Multiply by an inverse factor of D + sigma^2 R(rho), node by node.

    Kalman's filter for an AR(1) process seen in white noise: its standardised innovations are
    the whitened values. It costs one pass over the samples; a gap only weakens a correlation.

    Args:
        columns: [m, c].
        white: Diagonal of D [m].
        fresh: bool [m], whether a channel begins.
        gap: Samples since the value before [m].

    Returns:
        [m, g, c] and the log determinants [g].
    """
    variance = nodes.sigma**2
    decays = np.where(fresh[:, None], 0.0, nodes.rho ** gap[:, None])
    state, uncertain = np.zeros((len(variance), columns.shape[1])), variance
    result, log_det = np.empty((len(columns), *state.shape)), np.zeros(len(variance))
    for i, decay in enumerate(decays):
        state *= decay[:, None]
        uncertain = decay**2 * uncertain + (1.0 - decay**2) * variance
        total = uncertain + white[i]
        innovation = columns[i] - state
        gain = uncertain / total
        np.divide(innovation, np.sqrt(total)[:, None], out=result[i])
        state += gain[:, None] * innovation
        uncertain = gain * white[i]
        log_det += np.log(total)
    return result, log_det
