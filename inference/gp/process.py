"""Independent Gaussian processes over the same inputs.

Shapes: k processes; n points of d inputs u in [0, 1]. Learning is NumPy and LAPACK: nothing of a
few hundred numbers needs a compiler. Prediction is written for any array namespace, since NUTS
follows its gradient by JAX.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import get_lapack_funcs

from .namespaces import namespace, ndtri

TREND_SD = 3.0
"""Prior sd of a trend's coefficient, in units of the targets' sd: broad, yet proper."""
RELEVANT_LENGTH = 0.5  # length scale from which on a parameter's trend fades
JITTER = 1e-7
"""Variance added to every target, in units of the targets': below it rounding would rule."""
SCORE_EDGE = 1e-9  # quantile beyond which normal scores end
NO_TAIL, BOTH_TAILS, UPPER_TAIL, LOWER_TAIL = range(4)
HALF_NORMAL_MEAN, HALF_NORMAL_SD = (2.0 / np.pi) ** 0.5, (1.0 - 2.0 / np.pi) ** 0.5
ROUNDING = 1e-9  # of the prior variance, by which a joint covariance may fail to be positive
MIN_VARIANCE = 1e-10  # latent variance, which rounding may make negative
MIN_ROWS = 32  # of padded processes
BATCH = 256  # points of one product, which fits a processor's cache
POTRF, TRTRI = get_lapack_funcs(("potrf", "trtri"), dtype=np.float64)


class Data(NamedTuple):
    u: np.ndarray  # [n, d]
    y: np.ndarray  # [k, n], standardised
    tails: np.ndarray | None = None  # int [d], see `coordinates`; None for none
    spread: np.ndarray | None = None  # [n], by which the noise's variance is multiplied; None is 1

    def noise(self, log_noise: Any) -> np.ndarray:
        """Variances of the noise at each point [..., n], for sds of logs `log_noise` [...]."""
        variance = np.exp(2.0 * np.asarray(log_noise))[..., None]
        return variance * (np.ones(len(self.u)) if self.spread is None else self.spread)


class Hyper(NamedTuple):
    log_length: np.ndarray  # [k, d], in units of `coordinates`
    log_amplitude: np.ndarray  # [k], in units of y
    log_noise: np.ndarray  # [k], sd, in units of y


class GP(NamedTuple):
    """Conditioned processes, ready to predict."""

    hyper: Hyper
    data: Data
    whitener: np.ndarray  # [k, n, n], inverse Cholesky factors of the Gram matrices
    weights: np.ndarray  # [k, n], inverse Gram matrices times y, less what `prior` expects of it
    prior: "Cheap | None" = None  # what a cheaper simulator says beforehand

    def only(self, chosen: slice | np.ndarray) -> "GP":
        """Some of the processes."""
        hyper = Hyper(*(part[chosen] for part in self.hyper))
        data = self.data._replace(y=self.data.y[chosen])
        prior = None if self.prior is None else self.prior.only(chosen)
        return GP(hyper, data, self.whitener[chosen], self.weights[chosen], prior)


class Cheap(NamedTuple):
    """What runs of a cheaper simulator say of processes y = offset + slope * cheap + rest.

    The autoregressive model of Kennedy and O'Hagan (2000), eq. 1; the rest is the process of the
    `GP` that holds this. `cheap` is known by its own runs alone, as in the recursion of Le Gratiet
    and Garnier (2014), which need not be at the other's parameters.
    """

    gp: GP  # k processes, `cheap`, over `coordinates`
    slope: np.ndarray  # [k]
    offset: np.ndarray  # [k]
    unit: np.ndarray  # [k], sd of the rest, by which its trend's prior is narrower

    def only(self, chosen: slice | np.ndarray) -> "Cheap":
        """For some of the processes."""
        return Cheap(self.gp.only(chosen), *(part[chosen] for part in self[1:]))

    def mean(self, at: Any) -> Any:
        """Expected y [k, m] at coordinates [m, d]."""
        return self.offset[:, None] + self.slope[:, None] * predict_mean(self.gp, at)

    def covariance(self, a: Any, b: Any) -> Any:
        """Covariance [k, m, q] between coordinates a [m, d] and b [q, d] of what is expected."""
        return self.slope[:, None, None] ** 2 * predict_joint(self.gp, a, b)

    def variance(self, at: Any) -> Any:
        """[k, m] at coordinates [m, d]."""
        return self.slope[:, None] ** 2 * predict(self.gp, at)[1]


def coordinates(u: Any, tails: np.ndarray | None) -> Any:
    """Prior quantiles u [..., d] as the kernel sees them: scores where a prior has `tails` [d].

    A prior that fades out crowds its tail into an end of the box: what is smooth in the
    parameter is steep in its quantile there, and no stationary kernel follows. A prior with two
    tails is seen as normal scores, one with a single tail as scores of half a normal: at its other
    end, where it ends abruptly, a normal score would put its most probable values far out.
    Scores are scaled to the quantiles' mean and sd, so that one prior of the length scales serves
    all.
    """
    if tails is None:
        return u
    xp = namespace(u)
    half = xp.where(tails == LOWER_TAIL, 1.0 - u, u)
    folded = xp.where(tails == BOTH_TAILS, u, 0.5 + 0.5 * half)
    score = ndtri(xp.clip(folded, SCORE_EDGE, 1.0 - SCORE_EDGE))
    halved = (score - HALF_NORMAL_MEAN) / HALF_NORMAL_SD
    standard = xp.where(tails == BOTH_TAILS, score, xp.where(tails == LOWER_TAIL, -halved, halved))
    return xp.where(tails == NO_TAIL, u, 0.5 + standard / 12.0**0.5)


def covariance(hyper: Hyper, a: Any, b: Any, unit: Any = None) -> Any:
    """Prior covariances [k, m, n] of the latent functions at coordinates a [m, d] and b [n, d].

    Squared exponential plus the trend a_j x_j^2 + b_j x_j + c of Gutmann and Corander
    (JMLR 2016), x = 2a - 1. Its coefficients are integrated out under Gaussians rather
    than estimated with a_j >= 0: that keeps prediction closed-form and carries their
    uncertainty; and a discrepancy over quantiles may saturate, which a_j >= 0 forbids.
    The Gaussians narrow as a parameter's length scale grows, so that what does nothing has no
    trend either; what varies gently is left to the squared exponential in part (at length 1, the
    prior's median, the trend's sds are 0.45 and 0.2 of the full ones). Else what few runs cannot
    exclude of a trend grows towards the edges of the box, and the likelihood, which knows the
    surrogate's uncertainty, shuns them.

    Args:
        unit: Of the trends' sds [k]; None is 1.
    """
    xp = namespace(a)
    squared = (a[:, None, :] - b) ** 2
    rate = xp.exp(-2.0 * hyper.log_length)
    distance = rate @ squared.reshape(-1, squared.shape[-1]).T  # [k, m n]
    exponent = 2.0 * hyper.log_amplitude[:, None] - 0.5 * distance
    smooth = xp.exp(exponent).reshape(len(rate), *squared.shape[:2])
    return smooth + TREND_SD**2 * trend(hyper, a, unit) @ trend(hyper, b, unit).mT


def trend(hyper: Hyper, a: Any, unit: Any = None) -> Any:
    """Basis 1, r_j x_j, (r_j x_j)^2 at x = 2a - 1, times `unit`: a [m, d] -> [k, m, 1 + 2d]."""
    xp = namespace(a)
    x = relevance(hyper)[:, None, :] * (2.0 * a - 1.0)
    basis = xp.concat([xp.ones((*x.shape[:2], 1)), x, x**2], axis=2)
    return basis if unit is None else unit[:, None, None] * basis


def relevance(hyper: Hyper) -> Any:
    """r [k, d], 1 at short lengths, falling with long ones l as the slope of the squared
    exponential does, 1 / l."""
    xp = namespace(hyper.log_length)
    return 1.0 / xp.sqrt(1.0 + (xp.exp(hyper.log_length) / RELEVANT_LENGTH) ** 2)


def inverse_cholesky(matrix: np.ndarray) -> np.ndarray:
    """L^-1 [n, n] for a positive definite matrix L L^T; NaN if it is not."""
    factor, failed = POTRF(matrix.T, lower=True, clean=True)
    inverse, singular = TRTRI(factor, lower=True)
    return np.full_like(matrix, np.nan) if failed or singular else inverse


def condition(hyper: Hyper, data: Data, prior: Cheap | None = None) -> GP:
    """The processes given the data. Explicit inverse factors make prediction a product."""
    at, y = coordinates(data.u, data.tails), data.y
    gram = covariance(hyper, at, at, prior and prior.unit)
    if prior is not None:
        gram, y = gram + prior.covariance(at, at), y - prior.mean(at)
    noise = data.noise(hyper.log_noise) + JITTER
    whitener = np.stack(
        [inverse_cholesky(g + np.diag(s)) for g, s in zip(gram, noise, strict=True)]
    )
    white = np.einsum("kij,kj->ki", whitener, y)
    return GP(hyper, data, whitener, np.einsum("kij,ki->kj", whitener, white), prior)


def fantasize(gp: GP, u: np.ndarray, spread: np.ndarray | None = None) -> GP:
    """The processes after their own predictions at u [m, d] came true.

    The kriging believer of Ginsbourger et al. (2010): the mean stays, the variance shrinks.

    Args:
        spread: As of `Data`, at u [m]; None is the median of the data's.
    """
    data = gp.data
    y = np.concatenate([data.y, predict(gp, u)[0]], axis=1)
    if data.spread is not None:
        new = np.full(len(u), np.median(data.spread)) if spread is None else spread
        spread = np.concatenate([data.spread, new])
    return condition(gp.hyper, Data(np.concatenate([data.u, u]), y, data.tails, spread), gp.prior)


def padded(gp: GP, processes: int | None = None) -> GP:
    """The same with arrays of few shapes: points without weight, up to a power of two, and
    processes of no use, if more are wanted."""
    k, n = gp.weights.shape
    more = 0 if processes is None else processes - k
    extra = max(MIN_ROWS, 1 << (n - 1).bit_length()) - n
    widths = ((0, more), (0, extra))
    hyper = Hyper(*(np.pad(part, ((0, more), *[(0, 0)] * (part.ndim - 1))) for part in gp.hyper))
    u = np.pad(gp.data.u, ((0, extra), (0, 0)), constant_values=0.5)
    data = gp.data._replace(u=u, y=np.pad(gp.data.y, widths), spread=None)
    whitener = np.pad(gp.whitener, (*widths, (0, extra)))
    prior = gp.prior and Cheap(
        padded(gp.prior.gp, processes), *(np.pad(part, (0, more)) for part in gp.prior[1:])
    )
    return GP(hyper, data, whitener, np.pad(gp.weights, widths), prior)


def _cross(gp: GP, u: Any) -> tuple[Any, Any]:
    """Covariance [k, m, n] of the latent functions at u [m, d] and at the data; the variance
    [k, m] at u alone."""
    xp, unit = namespace(u), gp.prior and gp.prior.unit
    at, there = (coordinates(points, gp.data.tails) for points in (u, gp.data.u))
    trends = TREND_SD**2 * xp.sum(trend(gp.hyper, at, unit) ** 2, axis=-1)
    cross = covariance(gp.hyper, at, there, unit)
    alone = xp.exp(2.0 * gp.hyper.log_amplitude)[:, None] + trends
    if gp.prior is None:
        return cross, alone
    return cross + gp.prior.covariance(at, there), alone + gp.prior.variance(at)


def predict(gp: GP, u: Any) -> tuple[Any, Any]:
    """Means and variances [k, m] of the latent functions (without noise) at u [m, d]."""
    xp = namespace(u)
    parts = [_predict(gp, u[i : i + BATCH]) for i in range(0, max(len(u), 1), BATCH)]
    if len(parts) == 1:
        return parts[0]
    mean, variance = (xp.concat(part, axis=1) for part in zip(*parts, strict=True))
    return mean, variance


def predict_mean(gp: GP, u: Any) -> Any:
    """The means [k, m] alone."""
    return _mean(gp, u, _cross(gp, u)[0])


def _mean(gp: GP, u: Any, cross: Any) -> Any:
    mean = (cross @ gp.weights[:, :, None])[:, :, 0]
    return mean if gp.prior is None else gp.prior.mean(coordinates(u, gp.data.tails)) + mean


def _predict(gp: GP, u: Any) -> tuple[Any, Any]:
    xp = namespace(u)
    cross, alone = _cross(gp, u)
    mean = _mean(gp, u, cross)
    explained = xp.sum(_whitened(gp, cross) ** 2, axis=2)
    return mean, xp.maximum(alone - explained, MIN_VARIANCE)


def _whitened(gp: GP, cross: Any) -> Any:
    return cross @ gp.whitener.mT


def predict_joint(gp: GP, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Posterior covariance [k, m, q] of the latent functions between u [m, d] and v [q, d]."""
    at_u, at_v = _whitened(gp, _cross(gp, u)[0]), _whitened(gp, _cross(gp, v)[0])
    at, there = (coordinates(points, gp.data.tails) for points in (u, v))
    own = covariance(gp.hyper, at, there, gp.prior and gp.prior.unit) - at_u @ at_v.mT
    return own if gp.prior is None else own + gp.prior.covariance(at, there)


def draw(gp: GP, rng: np.random.Generator, u: np.ndarray, n: int) -> np.ndarray:
    """n draws of the latent functions at different points u [m, d]: [n, k, m]."""
    mean, _ = predict(gp, u)
    joint = predict_joint(gp, u, u)
    own = np.trace(joint, axis1=1, axis2=2) / len(u)
    least = ROUNDING * (own + np.exp(2.0 * gp.hyper.log_amplitude)) + MIN_VARIANCE
    factor = np.linalg.cholesky(joint + least[:, None, None] * np.eye(len(u)))
    return mean + (factor @ rng.normal(size=(n, *mean.shape, 1)))[..., 0]


def resolved(gp: GP, u: np.ndarray, runs: np.ndarray) -> np.ndarray:
    """Part of the variances at u [n, d] that a run at each of `runs` [m, d] resolves: [n, m, k]."""
    at_run = predict(gp, runs)[1] + np.exp(2.0 * gp.hyper.log_noise)[:, None]
    return np.moveaxis(predict_joint(gp, u, runs) ** 2 / at_run[:, None, :], 0, -1)


def leave_one_out(gp: GP) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance [k, n] of each y given all others (Rasmussen and Williams, eq. 5.12).

    The variance includes the noise.
    """
    variance = 1.0 / np.sum(gp.whitener**2, axis=1)
    return gp.data.y - gp.weights * variance, variance


def leave_one_out_log_densities(gp: GP) -> np.ndarray:
    """Log density [k, n] of each y given all others, less the constant -log(2 pi) / 2."""
    mean, variance = leave_one_out(gp)
    return -0.5 * ((gp.data.y - mean) ** 2 / variance + np.log(variance))


def leave_one_out_errors(gp: GP, n: int) -> np.ndarray:
    """Studentised errors [n, k] at the first n points; those after them are fantasised."""
    mean, variance = leave_one_out(gp)
    return ((gp.data.y - mean) / np.sqrt(variance)).T[:n]
