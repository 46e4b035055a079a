"""Independent priors, and the map between parameters and their prior quantiles."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import jax
import numpy as np
import numpyro.distributions as dist
from numpy.typing import ArrayLike
from scipy.special import ndtri

from ._float64 import in_float64
from .arguments import checked_array, checked_integer, checked_mapping, is_table, require
from .distributions import Univariate, describe
from .gp.process import BOTH_TAILS, LOWER_TAIL, NO_TAIL, UPPER_TAIL
from .types import Theta

RESERVED = frozenset(
    {"chain", "draw", "simulation", "seed", "discrepancy", "failed", "error", "round", "signal"}
)
QUANTILES = np.array([0.01, 0.1, 0.5, 0.9, 0.99])  # at which quantile functions are tried
TAIL_QUANTILE = 1e-12  # at which an unbounded prior is cut, so that u = 0 and 1 stay finite


class Prior:
    """Independent univariate priors by parameter name.

    The engine works in prior quantiles u = cdf(theta): there every prior is uniform on
    [0, 1]^d, and whatever is learned depends on no parameter's unit or scale.

    Args:
        distributions: Name -> scalar continuous numpyro distribution.
        units: Name -> unit, such as "Pa s", of those that have one; kept with the results.

    Raises:
        ValueError: no parameter, a reserved name, an unusable distribution, or the unit of
            an unknown parameter.
    """

    def __init__(
        self,
        distributions: Mapping[str, dist.Distribution],
        units: Mapping[str, str] | None = None,
    ):
        some = isinstance(distributions, Mapping) and distributions
        due = "map at least one parameter to its prior, such as {'a': dist.Uniform(0, 1)}"
        require(some, "distributions", due, distributions)
        self._univariate = {name: _checked(name, d) for name, d in distributions.items()}
        self.distributions = dict(distributions)
        self.units = checked_mapping("units", units, "texts")
        texts = all(isinstance(unit, str) for unit in self.units.values())
        due = f"map some of the parameters {tuple(distributions)} to texts"
        require(texts and set(self.units) <= set(distributions), "units", due, units)
        self._bounds = {name: u.bounds for name, u in self._univariate.items()}

    def __reduce__(self) -> tuple[Any, ...]:
        # a module of SciPy that unpickling imports before `scipy.stats` is imported twice, and
        # what was made by the first cannot be pickled again
        return Prior, (self.distributions, self.units)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.distributions)

    def __len__(self) -> int:
        return len(self.distributions)

    def __repr__(self) -> str:
        inside = ", ".join(f"{n!r}: {describe(d)}" for n, d in self.distributions.items())
        return f"Prior({{{inside}}})"

    def describe(self) -> dict[str, dict[str, str]]:
        """Name -> `prior`, such as "LogUniform(low=0.003, high=20)", and `units` where given."""
        return {
            name: {
                "prior": describe(distribution),
                **({"units": self.units[name]} if name in self.units else {}),
            }
            for name, distribution in self.distributions.items()
        }

    def to_array(self, theta: Theta) -> np.ndarray:
        """Stack parameters in the prior's order.

        Args:
            theta: Name -> scalar or [n].

        Returns:
            float64 [..., d].

        Raises:
            ValueError: names or shapes differ from the prior's, or a value is not finite.
        """
        if not is_table(theta) or set(theta.keys()) != set(self.names):
            got = tuple(theta.keys()) if is_table(theta) else repr(theta)[:100]
            raise ValueError(f"theta must map the parameters {self.names} to values, got {got}")
        columns = [checked_array(f"theta[{name!r}]", theta[name]) for name in self.names]
        shapes = {name: c.shape for name, c in zip(self.names, columns, strict=True)}
        alike = len(set(shapes.values())) == 1 and columns[0].ndim <= 1
        require(alike, "theta", "hold scalars or [n] arrays of one length", shapes)
        stacked = np.stack(columns, -1)
        if not np.isfinite(stacked).all():
            found = _first_of(~np.isfinite(stacked).all(-1), stacked, self.names)
            raise ValueError(f"theta must be finite, got {found}")
        return stacked

    def to_dict(self, array: np.ndarray) -> dict[str, np.ndarray]:
        """Split [..., d] into name -> [...]; inverse of `to_array`.

        Raises:
            ValueError: of another shape.
        """
        fits = np.shape(array)[-1:] == (len(self),)
        require(fits, "array", self._columns_due("column"), array)
        return {name: array[..., j] for j, name in enumerate(self.names)}

    def _columns_due(self, each: str) -> str:
        return f"have shape [..., {len(self)}], one {each} for each of the parameters {self.names}"

    @in_float64
    def to_unit(self, theta: Theta) -> np.ndarray:
        """Prior quantiles u [..., d] in [0, 1] of theta; outside the support 0 or 1."""
        natural = self.to_array(theta)
        columns = [
            self._univariate[name].cdf(np.clip(natural[..., j], *self._bounds[name]))
            for j, name in enumerate(self.names)
        ]
        return np.clip(np.stack(columns, -1), 0.0, 1.0)

    @in_float64
    def from_unit(self, u: np.ndarray) -> dict[str, np.ndarray]:
        """Parameters at prior quantiles u [..., d].

        0 and 1 give exactly the bounds of a prior that ends abruptly, as the uniform does,
        and a far but finite quantile of one that fades out, as the log-normal does at zero:
        so the prior's density is positive and finite there.

        Raises:
            ValueError: u is of another shape.
        """
        u = checked_array("u", u)
        fits = u.shape[-1:] == (len(self),)
        require(fits, "u", self._columns_due("quantile"), u.shape)
        return {
            name: _quantile(self._univariate[name], u[..., j]) for j, name in enumerate(self.names)
        }

    @cached_property
    @in_float64
    def tails(self) -> np.ndarray | None:
        """Ends at which each parameter, or its log, fades out like a normal one, int [d], see
        `gp.process.coordinates`; None where none does."""
        found = np.array([_tails(u) for u in self._univariate.values()])
        return found if found.any() else None

    def contains(self, theta: Theta) -> np.ndarray:
        """Whether theta lies in the support, bool [...]."""
        natural = self.to_array(theta)
        low, high = np.array([self._bounds[name] for name in self.names]).T
        return ((natural >= low) & (natural <= high)).all(-1)

    @in_float64
    def log_prob(self, theta: Theta) -> np.ndarray:
        """Log prior density of theta in natural units, [...]; -inf outside the support."""
        total = sum(self.log_probs(theta).values(), np.zeros(()))
        return np.where(self.contains(theta), total, -np.inf)

    @in_float64
    def log_probs(self, theta: Theta) -> dict[str, np.ndarray]:
        """Log prior density of each parameter in its own unit, name -> [...]; outside the support
        that at its edge."""
        natural = self.to_array(theta)
        found = {}
        for j, name in enumerate(self.names):
            # clip before the density: outside its support a distribution may answer anything
            clipped = np.clip(natural[..., j], *self._bounds[name])
            found[name] = self._univariate[name].log_prob(clipped)
        return found

    @in_float64
    def sample(self, key: jax.Array, n: int) -> dict[str, np.ndarray]:
        """Draw n parameters, name -> [n].

        Args:
            key: Of JAX, such as jax.random.key(0).
            n: How many.

        Raises:
            ValueError: no key, or n < 1.
        """
        n = checked_integer("n", n)
        check_key(key)
        return self.from_unit(np.asarray(jax.random.uniform(key, (n, len(self)))))


def checked_prior(prior: object) -> Prior:
    """`prior`.

    Raises:
        ValueError: it is no `Prior`.
    """
    if not isinstance(prior, Prior):
        raise ValueError(
            f"prior must be a Prior, got {prior!r:.100} of type {type(prior).__name__}; "
            "make one of name -> distribution by inference.Prior({...})"
        )
    return prior


def check_support(prior: Prior, theta: Theta) -> None:
    """Raise ValueError unless theta, name -> [n], lies in the prior's support."""
    outside = ~prior.contains(theta)
    if outside.any():
        found = _first_of(outside, prior.to_array(theta), prior.names)
        raise ValueError(
            f"theta must lie in the support of the prior, got {found}; leave these rows out, or "
            "widen the prior"
        )


def _first_of(wrong: ArrayLike, theta: np.ndarray, names: tuple[str, ...]) -> str:
    """The first row of theta [n, d] that is wrong, bool [n], and how many are, in words."""
    rows, at = np.atleast_2d(theta), np.flatnonzero(wrong)
    point = {name: float(rows[at[0], j]) for j, name in enumerate(names)}
    return f"{point} in row {at[0]}, the first of {at.size} such rows of {len(rows)}"


def _tails(univariate: Univariate) -> int:
    """The tails of the scores in which the parameter, or its log, is most nearly linear."""
    q = np.linspace(0.01, 0.99, 99)
    value = univariate.icdf(q)
    low = univariate.bounds[0]
    # the log of what may be zero would stretch the smallest values to infinity
    has_log = value.min() > 0.0 and (low > 0.0 or not _ends_abruptly(univariate, low))
    forms = [value, np.log(value)] if has_log else [value]
    scores = {
        NO_TAIL: q,
        BOTH_TAILS: ndtri(q),
        UPPER_TAIL: ndtri(0.5 + 0.5 * q),
        LOWER_TAIL: -ndtri(1.0 - 0.5 * q),
    }

    def linear(kind: int) -> float:
        return max(np.corrcoef(form, scores[kind])[0, 1] for form in forms)

    return max(scores, key=linear)


def _ends_abruptly(univariate: Univariate, bound: float) -> bool:
    return bool(np.isfinite(bound) and np.isfinite(univariate.log_prob(np.asarray(bound))))


def _quantile(univariate: Univariate, u: np.ndarray) -> np.ndarray:
    inner = univariate.icdf(np.clip(u, TAIL_QUANTILE, 1.0 - TAIL_QUANTILE))
    value = np.clip(inner, *univariate.bounds)
    for bound, there in zip(univariate.bounds, (u <= 0.0, u >= 1.0), strict=True):
        if _ends_abruptly(univariate, bound):
            value = np.where(there, bound, value)
    return value


def check_key(key: object) -> None:
    """Raise ValueError unless `key` is one key of JAX, new or old."""
    new = isinstance(key, jax.Array) and jax.numpy.issubdtype(key.dtype, jax.dtypes.prng_key)
    old = getattr(key, "dtype", None) == np.uint32 and np.shape(key) == (2,)  # pyright: ignore
    one = old or (new and key.shape == ())  # pyright: ignore
    require(one, "key", "be one key of JAX, such as jax.random.key(0)", key)


@in_float64
def _checked(name: str, distribution: object) -> Univariate:
    named = isinstance(name, str) and name and "/" not in name
    require(named, "a parameter's name", "be text without '/'", name)
    due = "be none that is reserved for results"
    require(name not in RESERVED, "a parameter's name", due, name, cure="choose another name")
    its = f"prior of {name!r}"
    if not isinstance(distribution, dist.Distribution):
        raise ValueError(
            f"{its} must be a numpyro distribution, got {type(distribution).__name__}; for a fixed "
            "value leave the parameter out"
        )
    shape = distribution.batch_shape + distribution.event_shape
    cure = "give one distribution per parameter"
    require(not shape, its, "be univariate with shape ()", shape, cure=cure)
    shown = describe(distribution)
    if distribution.is_discrete:
        raise ValueError(
            f"{its} must be continuous, got {shown}; give a Uniform from half below the least "
            "number to half above the largest, and round in the simulator"
        )
    try:
        with np.errstate(invalid="ignore", divide="ignore"):
            univariate = Univariate(distribution)
            returned = univariate.cdf(univariate.icdf(QUANTILES))
    except (NotImplementedError, ImportError) as error:  # numpyro asks for TFP in some icdf
        raise ValueError(
            f"{its} needs cdf and icdf, which {type(distribution).__name__} lacks; "
            "use for example Uniform, LogUniform, Normal, LogNormal, TruncatedNormal, Gamma or Beta"
        ) from error
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"{its} must have real numbers as arguments, got a "
            f"{type(distribution).__name__} of which {error}"
        ) from error
    low, high = univariate.bounds
    if low >= high:
        raise ValueError(
            f"{its} must begin below its end, got {shown}; exchange its bounds, or leave a fixed "
            "parameter out"
        )
    if not np.allclose(returned, QUANTILES):
        raise ValueError(
            f"{its} must be continuous, with finite arguments, got {shown}, whose cdf(icdf(q)) is "
            f"{returned} at q = {QUANTILES}; a bound may lie too far out in a tail"
        )
    return univariate
