"""Priors, and the map between parameters and their prior quantiles."""

from collections.abc import Callable, Mapping
from functools import cached_property
from itertools import count
from typing import Any, cast

import jax
import numpy as np
import numpyro.distributions as dist
from numpy.typing import ArrayLike
from scipy.special import ndtri

from ._float64 import in_float64
from .arguments import (
    check_called,
    checked_array,
    checked_integer,
    checked_mapping,
    is_table,
    require,
)
from .distributions import Univariate, describe
from .gp.process import BOTH_TAILS, LOWER_TAIL, NO_TAIL, UPPER_TAIL
from .model_sites import visit
from .types import Theta

RESERVED = frozenset(
    {"chain", "draw", "simulation", "seed", "discrepancy", "failed", "error", "round", "signal"}
)
QUANTILES = np.array([0.01, 0.1, 0.5, 0.9, 0.99])  # at which quantile functions are tried
TAIL_QUANTILE = 1e-12  # at which an unbounded prior is cut, so that u = 0 and 1 stay finite


class Prior:
    """Univariate priors by parameter name, each of which may depend on the parameters before it.

    The engine works in prior quantiles u = cdf(theta): there every prior is uniform on
    [0, 1]^d, and whatever is learned depends on no parameter's unit or scale. Of a parameter that
    depends on others it is the quantile given these (Rosenblatt, Ann. Math. Stat. 23, 1952).

    Args:
        distributions: Name -> scalar continuous numpyro distribution; or, where these depend on
            one another, a model of numpyro: a function without arguments, which calls
            `numpyro.sample(name, distribution)` for each parameter.
        units: Name -> unit, such as "Pa s", of those that have one; kept with the results.

    Attributes:
        model: The model; None where the parameters are independent.

    Raises:
        ValueError: no parameter, a reserved name, an unusable distribution, or the unit of
            an unknown parameter; a model that has other than scalar parameters, or cannot be
            called with arrays for these.

    Example:
        >>> import numpy as np
        >>> import numpyro.distributions as dist
        >>> from bolfi_liquids import inference
        >>> prior = inference.Prior({"viscosity": dist.LogUniform(0.01, 1)}, {"viscosity": "Pa s"})
        >>> prior.from_unit(np.array([[0.5]]))["viscosity"].round(3)
        array([0.1])
        >>> prior.to_unit({"viscosity": np.array([0.1])}).round(3)
        array([[0.5]])
    """

    def __init__(
        self,
        distributions: Mapping[str, dist.Distribution] | Callable[[], object],
        units: Mapping[str, str] | None = None,
    ):
        of_model = callable(distributions) and not isinstance(distributions, dist.Distribution)
        self.model: Callable[[], object] | None = cast(Any, distributions) if of_model else None
        given: Any = _at_medians(self.model) if self.model is not None else distributions
        due = (
            "map at least one parameter to its prior, such as {'a': dist.Uniform(0, 1)}, or be a "
            "model of numpyro"
        )
        require(isinstance(given, Mapping) and given, "distributions", due, distributions)
        self._univariate = {name: _checked(name, d) for name, d in given.items()}
        self.units = checked_mapping("units", units, "texts")
        texts = all(isinstance(unit, str) for unit in self.units.values())
        due = f"map some of the parameters {tuple(given)} to texts"
        require(texts and set(self.units) <= set(given), "units", due, units)
        if self.model is not None:
            self._check_model()

    def __reduce__(self) -> tuple[Any, ...]:
        # a module of SciPy that unpickling imports before `scipy.stats` is imported twice, and
        # what was made by the first cannot be pickled again
        return Prior, (self.model or self.distributions, self.units)

    @property
    def distributions(self) -> dict[str, dist.Distribution]:
        """Name -> distribution, of independent parameters.

        Raises:
            ValueError: they are a model's.
        """
        cure = "add what else is unknown to the model"
        require(self.model is None, "prior", "have independent parameters", self, cure=cure)
        return {name: one.distribution for name, one in self._univariate.items()}

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._univariate)

    def __len__(self) -> int:
        return len(self._univariate)

    def __repr__(self) -> str:
        inside = ", ".join(f"{name!r}: {of['prior']}" for name, of in self.describe().items())
        return f"Prior({{{inside}}})"

    def describe(self) -> dict[str, dict[str, str]]:
        """Name -> `prior`, such as "LogUniform(low=0.003, high=20)", and `units` where given; of a
        parameter that depends on others the prior at their medians."""
        return {
            name: {
                "prior": describe(univariate.distribution) + self._conditions.get(name, ""),
                **({"units": self.units[name]} if name in self.units else {}),
            }
            for name, univariate in self._univariate.items()
        }

    @cached_property
    @in_float64
    def _conditions(self) -> dict[str, str]:
        """Parameter that depends on others -> at which values `describe` has its prior."""
        medians = self.from_unit(np.full((2, len(self)), 0.5))
        said = [f"{name}={values[0]:.4g}" for name, values in medians.items()]
        given = [univariate for _, univariate in self._given(self.to_array(medians))]
        return {
            name: f" given {', '.join(said[:place])}"
            for place, name in enumerate(self.names)
            if given[place].distribution.batch_shape
        }

    @in_float64
    def _check_model(self) -> None:
        """Raise ValueError unless a model's parameters have quantiles for arrays of them, too."""
        rng = np.random.default_rng(0)
        ends = rng.choice([TAIL_QUANTILE, 0.5, 1.0 - TAIL_QUANTILE], (64, len(self)))
        u = np.concatenate([rng.random((64, len(self))), ends])
        told = "its distributions for arrays are others than for numbers, or end before they begin"
        try:
            theta = self.from_unit(u)
            alone = [self.to_array(self.from_unit(row)) for row in u[:4]]
            alike = np.allclose(self.to_array(theta)[:4], alone)
            alike = alike and np.allclose(self.to_unit(theta), u, atol=1e-6)
        except (TypeError, ValueError, NotImplementedError) as error:
            alike, told = False, str(error) or f"{type(error).__name__} of numpyro"
        if not alike:
            raise ValueError(
                "the model of a prior must take arrays [n] as its parameters, and have proper "
                f"distributions wherever those before may lie ({told}); write jnp.where for `if`, "
                "and see to the order of bounds"
            )

    def _visit(self, choose: Callable[[int, Univariate], np.ndarray]) -> None:
        """Visit the parameters in order.

        Args:
            choose: Function (place, distribution given those before) -> values [...], which those
                after are given.
        """
        if self.model is None:
            for place, univariate in enumerate(self._univariate.values()):
                choose(place, univariate)
        else:
            places = count()
            visit(self.model, lambda _, given: choose(next(places), Univariate(given)))

    def _given(self, natural: np.ndarray) -> list[tuple[np.ndarray, Univariate]]:
        """Of each parameter in theta [..., d] its values, moved into the support, and its
        distribution given those before."""
        found: list[tuple[np.ndarray, Univariate]] = []

        def inside(place: int, univariate: Univariate) -> np.ndarray:
            found.append((np.clip(natural[..., place], *univariate.bounds), univariate))
            return found[-1][0]

        self._visit(inside)
        return found

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
        given = self._given(self.to_array(theta))
        return np.clip(np.stack([one.cdf(values) for values, one in given], -1), 0.0, 1.0)

    @in_float64
    def from_unit(self, u: np.ndarray) -> dict[str, np.ndarray]:
        """Parameters at prior quantiles u [..., d].

        0 and 1 give exactly the bounds of a prior that ends abruptly, as the uniform does,
        and a far but finite quantile of one that fades out, as the log-normal does at zero:
        so the prior's density is positive and finite there. Those of a model give such a quantile
        in any case: at a bound of one parameter another may have no freedom left.

        Raises:
            ValueError: u is of another shape.
        """
        u, theta = checked_array("u", u), []
        fits = u.shape[-1:] == (len(self),)
        require(fits, "u", self._columns_due("quantile"), u.shape)
        quantile = _quantile if self.model is None else _inner_quantile

        def values(place: int, univariate: Univariate) -> np.ndarray:
            theta.append(quantile(univariate, u[..., place]))
            return theta[-1]

        self._visit(values)
        return dict(zip(self.names, theta, strict=True))

    @cached_property
    @in_float64
    def tails(self) -> np.ndarray | None:
        """Ends at which each parameter, or its log, fades out like a normal one, int [d], see
        `gp.process.coordinates`; None where none does."""
        found = np.array([_tails(u) for u in self._univariate.values()])
        return found if found.any() else None

    @in_float64
    def contains(self, theta: Theta) -> np.ndarray:
        """Whether theta lies in the support, bool [...]."""
        natural = self.to_array(theta)
        return _inside(natural, self._given(natural))

    @in_float64
    def log_prob(self, theta: Theta) -> np.ndarray:
        """Log prior density of theta in natural units, [...]; -inf outside the support."""
        natural = self.to_array(theta)
        given = self._given(natural)  # outside its support a distribution may answer anything
        total = sum(one.log_prob(values) for values, one in given)
        return np.where(_inside(natural, given), total, -np.inf)

    @in_float64
    def log_probs(self, theta: Theta) -> dict[str, np.ndarray]:
        """Log prior density of each parameter in its own unit, name -> [...]; outside the support
        that at its edge."""
        given = self._given(self.to_array(theta))
        return {n: one.log_prob(values) for n, (values, one) in zip(self.names, given, strict=True)}

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


def _inside(natural: np.ndarray, given: list[tuple[np.ndarray, Univariate]]) -> np.ndarray:
    """Whether theta [..., d] lies in the support, bool [...]; `given` is of `Prior._given`."""
    within = [
        (values == natural[..., place]) & (one.bounds[0] < one.bounds[1])
        for place, (values, one) in enumerate(given)
    ]
    return np.all(within, axis=0)


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


def _inner_quantile(univariate: Univariate, u: np.ndarray) -> np.ndarray:
    inner = univariate.icdf(np.clip(u, TAIL_QUANTILE, 1.0 - TAIL_QUANTILE))
    return np.clip(inner, *univariate.bounds)


def _quantile(univariate: Univariate, u: np.ndarray) -> np.ndarray:
    value = _inner_quantile(univariate, u)
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
def _at_medians(model: Callable[[], object]) -> dict[str, dist.Distribution]:
    """The distributions of a model's parameters, each given the medians of those before."""
    check_called("distributions", model)
    found: dict[str, dist.Distribution] = {}

    def median(name: str, given: Any) -> np.ndarray:
        require(name not in found, "the model of a prior", "name each parameter once", name)
        found[name] = given
        return _checked(name, given).icdf(np.asarray(0.5))[()]

    visit(model, median)
    return found


@in_float64
def _checked(name: str, distribution: object) -> Univariate:
    named = isinstance(name, str) and name and name.isprintable() and "/" not in name
    require(named, "a parameter's name", "be printable text without '/'", name)
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
