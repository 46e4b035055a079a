"""Distributions of numpyro with all that the engine needs, where numpyro itself lacks it too."""

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpyro.distributions as dist

from ._lazy import stats

SCIPY: dict[type, Callable[[Any], Any]] = {
    dist.Uniform: lambda d: stats.uniform(d.low, d.high - d.low),
    dist.LogUniform: lambda d: stats.loguniform(d.low, d.high),
    dist.Normal: lambda d: stats.norm(d.loc, d.scale),
    dist.LogNormal: lambda d: stats.lognorm(d.scale, scale=np.exp(d.loc)),
    dist.HalfNormal: lambda d: stats.halfnorm(scale=d.scale),
    dist.Exponential: lambda d: stats.expon(scale=1.0 / d.rate),
    dist.Cauchy: lambda d: stats.cauchy(d.loc, d.scale),
    dist.Laplace: lambda d: stats.laplace(d.loc, d.scale),
    dist.Logistic: lambda d: stats.logistic(d.loc, d.scale),
    dist.Beta: lambda d: stats.beta(d.concentration1, d.concentration0),
    dist.Gamma: lambda d: stats.gamma(d.concentration, scale=1.0 / d.rate),
    dist.InverseGamma: lambda d: stats.invgamma(d.concentration, scale=d.rate),
    dist.StudentT: lambda d: stats.t(d.df, d.loc, d.scale),
    dist.Weibull: lambda d: stats.weibull_min(d.concentration, scale=d.scale),
    dist.Chi2: lambda d: stats.chi2(d.df),
}
"""SciPy's equals, where numpyro leaves quantiles to TensorFlow Probability or lacks them, and of
the usual ones: the engine works in quantiles and differentiates none of these, and outside a
compiled function each of JAX's operations would be compiled by itself."""


class Truncated:
    """A distribution truncated to an interval.

    Probabilities are counted from the tail in which the bounds lie: from the other end, those
    beyond some eight standard deviations of a normal one are 1 to the last digit.

    Args:
        base: Of SciPy, frozen.
        low, high: Bounds, which may be infinite, and arrays.
    """

    def __init__(self, base: Any, low: Any, high: Any):
        self.base, self.upper = base, low > base.median()
        self.start, self.mass = self.tail(low), self.tail(high) - self.tail(low)

    def tail(self, value: Any) -> np.ndarray:
        return np.where(self.upper, self.base.sf(value), self.base.cdf(value))

    def cdf(self, value: np.ndarray) -> np.ndarray:
        return (self.tail(value) - self.start) / self.mass

    def ppf(self, q: np.ndarray) -> np.ndarray:
        tail = self.start + q * self.mass
        return np.where(self.upper, self.base.isf(tail), self.base.ppf(tail))

    def logpdf(self, value: np.ndarray) -> np.ndarray:
        """Within the bounds."""
        return self.base.logpdf(value) - np.log(np.abs(self.mass))


TRUNCATED = (
    dist.LeftTruncatedDistribution,
    dist.RightTruncatedDistribution,
    dist.TwoSidedTruncatedDistribution,
)


def _frozen(distribution: Any, bounds: tuple[Any, Any]) -> Any:
    """SciPy's equal of a distribution, or None."""
    truncated = isinstance(distribution, TRUNCATED)
    whole = distribution.base_dist if truncated else distribution
    make = SCIPY.get(type(whole))
    if make is None:
        return None
    return Truncated(make(whole), *bounds) if truncated else make(whole)


class Univariate:
    """cdf, icdf, log density and bounds of a scalar distribution, on NumPy arrays.

    Args:
        distribution: Of numpyro, with event shape (), and batch shape () or that of the arrays.
    """

    def __init__(self, distribution: dist.Distribution):
        self.distribution = distribution
        support: Any = distribution.support
        self.bounds: tuple[Any, Any] = (
            np.asarray(getattr(support, "lower_bound", -np.inf), np.float64)[()],
            np.asarray(getattr(support, "upper_bound", np.inf), np.float64)[()],
        )
        self._scipy = _frozen(distribution, self.bounds)

    @cached_property
    def _inner(self) -> np.ndarray:
        return self.icdf(np.asarray(0.5))

    def cdf(self, value: np.ndarray) -> np.ndarray:
        made = self.distribution.cdf(value) if self._scipy is None else self._scipy.cdf(value)
        return np.asarray(made, np.float64)

    def icdf(self, q: np.ndarray) -> np.ndarray:
        made = self.distribution.icdf(q) if self._scipy is None else self._scipy.ppf(q)
        return np.asarray(made, np.float64)

    def log_prob(self, value: np.ndarray) -> np.ndarray:
        """Log density; -inf where it vanishes or the value is outside the support."""
        if self._scipy is not None:
            return np.asarray(self._scipy.logpdf(value), np.float64)
        # numpyro warns of values outside, among which it counts the zero of positive ones
        support: Any = self.distribution.support
        inside = np.asarray(support(value))
        made = self.distribution.log_prob(np.where(inside, value, self._inner))
        return np.where(inside, np.asarray(made, np.float64), -np.inf)


def describe(distribution: dist.Distribution) -> str:
    """Such as "LogUniform(low=0.003, high=20)"."""
    name = type(distribution).__name__
    parts = [f"{key}={_number(distribution, key)}" for key in distribution.arg_constraints]
    base = getattr(distribution, "base_dist", None)
    if "Truncated" in name and base is not None:
        inner = [f"{key}={_number(base, key)}" for key in base.arg_constraints]
        return f"Truncated{type(base).__name__}({', '.join(inner + parts)})"
    if not parts and base is not None:
        parts = [describe(base), *map(_transform, getattr(distribution, "transforms", ()))]
    return f"{name}({', '.join(parts)})"


def _transform(transform: Any) -> str:
    held = {key: np.asarray(value) for key, value in vars(transform).items()}
    numbers = [f"{key}={v}" for key, v in held.items() if v.ndim == 0 and v.dtype.kind in "biuf"]
    return f"{type(transform).__name__}({', '.join(numbers)})"


def _number(distribution: dist.Distribution, key: str) -> str:
    value = getattr(distribution, key, None)
    return "?" if value is None else f"{float(np.asarray(value)):.7g}"


Table = Mapping[str, Any]
"""Family and arguments of a distribution: texts, numbers, and such a table for another one."""


def to_table(distribution: Any) -> Table:
    """Such as {"family": "LogUniform", "high": 20.0, "low": 0.003}, in which `family` is the name
    of a distribution of numpyro and the rest are its arguments.

    What is more than its numbers, such as one that is transformed, is lost: see whether the
    distribution that `from_table` makes is the same.

    Raises:
        AttributeError, TypeError, ValueError: it has not the numbers that its class names.
    """
    family = type(distribution).__name__
    names = sorted(distribution.arg_constraints)
    # of a float32 its shortest text: 0.003 stays 0.003
    table = {name: float(str(getattr(distribution, name))) for name in names}
    if isinstance(distribution, TRUNCATED):  # by a function of numpyro, whose name is no class's
        base = to_table(getattr(distribution, "base_dist"))  # noqa: B009  of no common type
        return {"family": "TruncatedDistribution", "base_dist": base, **table}
    return {"family": family, **table}


def from_table(table: Table) -> dist.Distribution:
    """The distribution that `to_table` described.

    Raises:
        ValueError: numpyro knows none by that name.
        TypeError: it does not take these arguments.
    """
    arguments = {
        key: from_table(value) if isinstance(value, Mapping) else value
        for key, value in table.items()
        if key != "family"
    }
    family: Any = getattr(dist, str(table.get("family")), None)
    if family is None:
        raise ValueError(f"no distribution of numpyro is described by {dict(table)!r}")
    return family(**arguments)
