"""The approximate likelihood of a threshold on the discrepancy, or on a transform of it."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri, owens_t

from ..gp.namespaces import log_ndtr, log_sum_exp, namespace
from ..gp.process import GP, predict
from .processes import log_success

ROUNDING = 1e-9  # of the largest discrepancy, below which differences tell nothing
NEAR_SHARE = 0.25  # of the runs, to which a logarithm may be linear
MATCHED_QUANTILE, LEAST_QUANTILE = 0.2, 0.02  # of a new discrepancy at the minimum
FAR_BELOW = 1e-9  # of the way from a logarithm's end to the least discrepancy
EXCESSES = np.geomspace(1e-8, 1e4, 400)  # over the least discrepancy, in units of it
LOG_LIKELIHOOD_VARIANCE = 0.5  # of one error, where the discrepancy is minus a log likelihood
NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(48)
MIN_EXACT_SHARE = 1e-6  # of Phi(z), below which the difference with Owen's T has lost its digits


class Transform(NamedTuple):
    """g(Delta + offset); an offset is where a zero would break the log or the Jacobian, or where
    the logarithm shall resolve the least discrepancies, whatever their sign."""

    name: str
    offset: float
    signed: bool = False

    def __call__(self, discrepancy: np.ndarray) -> np.ndarray:
        return TRANSFORMS[self.name][0](np.asarray(discrepancy) + self.offset)

    def inverse(self, value: np.ndarray) -> np.ndarray:
        """Delta where g(Delta + offset) = value; 0 where that would be negative, unless some
        discrepancies are."""
        if self.name == "identity":
            return np.asarray(value)
        raw = np.exp(value) if self.name == "log" else np.maximum(value, 0.0) ** 2
        return raw - self.offset if self.signed else np.maximum(raw - self.offset, 0.0)

    def log_jacobian(self, discrepancy: np.ndarray) -> np.ndarray:
        """log |dg / dDelta|."""
        return TRANSFORMS[self.name][1](np.asarray(discrepancy) + self.offset)


Function = Callable[[np.ndarray], np.ndarray]
TRANSFORMS: dict[str, tuple[Function, Function]] = {
    "identity": (lambda x: x, np.zeros_like),
    "sqrt": (np.sqrt, lambda x: -np.log(2.0) - 0.5 * np.log(x)),
    "log": (np.log, lambda x: -np.log(x)),
}


def candidates(name: str | None, discrepancy: np.ndarray) -> list[Transform]:
    """The transforms that `discrepancy` admits.

    Args:
        name: One of TRANSFORMS, or None for all that apply, and a logarithm that is linear among
            the least discrepancies, which adapts as the search closes in.
        discrepancy: Finite values [n].

    Raises:
        ValueError: sqrt or log of negative discrepancies.
    """
    lowest = discrepancy.min()
    if lowest < 0 and name not in (None, "identity"):
        raise ValueError(
            f"transform {name!r} needs discrepancies >= 0, got {lowest:.3g}; use 'identity'"
        )
    names = ("identity",) if lowest < 0 else tuple(TRANSFORMS) if name is None else (name,)
    found = [Transform(n, 0.0 if n == "identity" else _offset(discrepancy)) for n in names]
    near = float(np.quantile(discrepancy, NEAR_SHARE)) - lowest
    if name is not None or near <= ROUNDING * np.abs(discrepancy).max():
        return found
    return [*found, Transform("log", near - lowest, bool(lowest < 0))]


def _offset(discrepancy: np.ndarray) -> float:
    """Half the smallest positive discrepancy if some are zero, else 0."""
    if discrepancy.min() > 0:
        return 0.0
    positive = discrepancy[discrepancy > 0]
    return float(positive.min()) / 2 if positive.size else 1.0


class ThresholdLikelihood(NamedTuple):
    """The likelihood; its threshold in the standardised units of the GP."""

    gp: GP  # one process
    threshold: np.ndarray  # []
    width: np.ndarray  # [], sd that the threshold has itself
    resolution: np.ndarray  # [], sd of the latent mean from which doubt counts against a place
    success: GP | None = None  # see `processes.learn_success`
    doubt: np.ndarray = np.ones(())  # the part of the latent variance that counts

    def __call__(self, u: Any) -> Any:
        """log P(success) Phi((eps - mu(u)) / sigma(u)) at u [n, d], sigma^2 the variance of a new
        discrepancy, and of the threshold where it has a width.

        Where the latent variance v is small beside resolution^2, that is the paper's. Where it is
        large, nothing was learned, and ignorance shall not count as agreement: sigma^2 has no more
        of v than v / (1 + v / resolution^2), and the root of the rest is added to mu.

        Gutmann and Corander (2016), eq. for Gaussian-process surrogates; Lopez-Guevara et al.
        (2018), inference.
        """
        z, _, _ = self._standardised(u)
        return log_ndtr(z[:, 0]) + log_success(self.success, u)

    def known(self, u: np.ndarray, latent: np.ndarray) -> np.ndarray:
        """The log likelihood [n], were the mean discrepancies at u [n, d] latent [1, n]."""
        sd = np.hypot(np.exp(self.gp.hyper.log_noise), self.width)
        return log_ndtr((self.threshold - latent[0]) / sd) + log_success(self.success, u)

    def second_moment(self, u: np.ndarray, spread: np.ndarray | None) -> np.ndarray:
        """log E[L(u)^2], over a latent mean that varies with variance `spread` [n, ..., k].

        `spread` is the latent variance now (None), which gives the second moment of the unknown
        likelihood (Jarvenpaa et al. 2019, MaxVar), or that part of it which further simulations
        will resolve (their expected integrated variance). Both are the chance that two variables
        of correlation r = spread / sigma^2 lie below z: Phi(z) - 2 T(z, sqrt((1 - r) / (1 + r))),
        T Owen's; where that cancels, which takes a small r,
        E_w[Phi((z + sqrt(r) w) / sqrt(1 - r))^2] by Gauss and Hermite about the integrand's peak.
        """
        z, noisy, latent = self._standardised(u)
        varying = latent if spread is None else spread
        shape = len(u), *[1] * (varying.ndim - 2), z.shape[1]
        r = np.clip(varying / noisy.reshape(shape), 1e-12, 1.0 - 1e-6)
        z = np.broadcast_to(z.reshape(shape), r.shape)
        return log_both_below(z, r)[..., 0] + 2.0 * log_success(self.success, u).reshape(shape[:-1])

    def _standardised(self, u: Any) -> tuple[Any, Any, Any]:
        """(eps - mu) / sigma, sigma^2, and the part of it that is latent, [n, k] each."""
        xp = namespace(u)
        mean, variance = predict(self.gp, u)
        variance = self.doubt * variance.T
        latent = variance / (1.0 + variance / self.resolution**2)
        doubt = variance / xp.sqrt(self.resolution**2 + variance)
        noisy = latent + xp.exp(2.0 * self.gp.hyper.log_noise) + self.width**2
        return (self.threshold - mean.T - doubt) / xp.sqrt(noisy), noisy, latent


def log_both_below(z: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Log chance that two standard normals of correlation r lie below z, both [...]."""
    exact = ndtr(z) - 2.0 * owens_t(z, np.sqrt((1.0 - r) / (1.0 + r)))
    kept = exact > MIN_EXACT_SHARE * ndtr(z)
    both = np.log(np.where(kept, exact, 1.0))
    return np.where(kept, both, _log_both_by_quadrature(z[..., None], r[..., None]))


def _log_both_by_quadrature(z: np.ndarray, r: np.ndarray) -> np.ndarray:
    """`log_both_below` at z and r [..., 1]."""
    peak = 2.0 * np.sqrt(r) / (1.0 + r) * np.maximum(-z, 0.0)
    width = np.where(z < 0.0, np.sqrt((1.0 - r) / (1.0 + r) + r), 1.0)
    w = peak + width * NODES
    inside = 2.0 * log_ndtr((z + np.sqrt(r) * w) / np.sqrt(1.0 - r)) - 0.5 * (w**2 - NODES**2)
    return log_sum_exp(inside + np.log(width * WEIGHTS / np.sqrt(2.0 * np.pi)))


class Quantile(NamedTuple):
    """Threshold at the q quantile of the simulated discrepancies, 0 <= q <= 1."""

    q: float


class Predicted(NamedTuple):
    """Threshold at the q quantile of a new discrepancy where the surrogate expects least of it
    among the simulated points, 0 < q < 1."""

    q: float


class Matched(NamedTuple):
    """Threshold, with a width, at which the posterior is as wide as that of data with `numbers`
    independent normal errors of unknown size, of whose squares the discrepancy is a sum; see
    `matched`."""

    numbers: float


Threshold = str | float | Quantile | Predicted | Matched | None
RULES = {"min_mean": Predicted(0.5), "min_observed": Quantile(0.0)}


def check_rule(rule: Threshold) -> None:
    """Raise ValueError unless `rule` is a documented threshold rule."""
    match rule:
        case Quantile(q):
            valid = 0.0 <= q <= 1.0
        case Predicted(q):
            valid = 0.0 < q < 1.0
        case Matched(numbers):
            valid = numbers > 0
        case str():
            valid = rule in RULES
        case _:
            number = isinstance(rule, float | int | np.number) and np.isfinite(rule)
            valid = rule is None or number
    if not valid:
        raise ValueError(
            f"threshold must be one of {tuple(RULES)}, Predicted(q) with 0 < q < 1, Quantile(q) "
            f"with 0 <= q <= 1, Matched(numbers) with numbers > 0, a finite "
            f"number on the discrepancy's scale or None, got {rule!r}"
        )


def matched(
    rule: Matched, mean: float, sd: float, transform: Transform, dimension: int
) -> tuple[float, float]:
    """Threshold and its width on the transformed scale.

    Near its least value D the discrepancy is D plus a quadratic form, of which the exact
    posterior expects d s^2, where s^2 = D / (numbers - d) estimates the variance of one error.
    With a width, sigma^2 = sd^2 + width^2, the likelihood expects as much at the threshold
    Predicted(0.2). Where sd alone makes it expect more, there is no width, and the threshold is
    lower, down to Predicted(0.02). A discrepancy below zero is taken for minus a log likelihood.

    Args:
        mean, sd: Of a new discrepancy where least is expected, on the transformed scale.
        dimension: d.
    """
    least = float(transform.inverse(np.asarray(mean)))
    variance = least / max(rule.numbers - dimension, 1.0) if least > 0 else LOG_LIKELIHOOD_VARIANCE
    unit, q = max(least, variance), EXCESSES
    raised = transform(least + unit * q)

    def excess(z: float, sigma: float) -> float:
        weights = q ** (dimension / 2) * ndtr(z - (raised - mean) / sigma)  # of log q
        return float(np.log(weights @ q / weights.sum() / (dimension * variance / unit)))

    def root_of(function: Callable[[float], float], low: float, high: float) -> float:
        return float(brentq(function, low, high))  # pyright: ignore[reportArgumentType]

    usual, lowest = float(ndtri(MATCHED_QUANTILE)), float(ndtri(LEAST_QUANTILE))
    if excess(usual, sd) < 0.0:
        top = float(raised[-1] - mean)
        wide = excess(usual, top) < 0.0
        sigma = top if wide else root_of(lambda sigma: excess(usual, sigma), sd, top)
        return mean + usual * sigma, float(np.sqrt(max(sigma**2 - sd**2, 0.0)))
    z = lowest if excess(lowest, sd) > 0.0 else root_of(lambda z: excess(z, sd), lowest, usual)
    return mean + z * sd, 0.0


def choose_threshold(
    rule: str | float | Quantile | Predicted,
    discrepancy: np.ndarray,
    transform: Transform,
    least: tuple[float, float],
) -> float:
    """The threshold on the transformed scale.

    Args:
        rule: Predicted(q); "min_mean", the mean where it is least (Gutmann and Corander 2016); a
            Quantile; "min_observed", the smallest discrepancy; or a number on the discrepancy's own
            scale.
        discrepancy: Finite values [n].
        transform: That of the surrogate.
        least: Mean and sd of a new discrepancy at the simulated point where the mean is least, on
            the transformed scale. Elsewhere the mean may extrapolate below anything that a
            discrepancy can be.

    Raises:
        ValueError: the transform is undefined at the given number.
    """
    rule = RULES[rule] if isinstance(rule, str) else rule
    if isinstance(rule, Predicted):
        return least[0] + least[1] * float(ndtri(rule.q))
    if isinstance(rule, Quantile):
        return float(transform(np.quantile(discrepancy, rule.q)))
    number = float(rule)  # pyright: ignore[reportArgumentType]  # `check_rule`
    if transform.offset < 0 or transform.signed:  # below lies nothing that was simulated
        end = -transform.offset
        return float(transform(max(number, end + FAR_BELOW * (discrepancy.min() - end))))
    if transform.name != "identity" and number + transform.offset <= 0:
        raise ValueError(
            f"threshold {rule} must be positive for the transform {transform.name!r}; "
            "give a positive one or transform='identity'"
        )
    return float(transform(np.asarray(number)))
