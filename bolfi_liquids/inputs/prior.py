"""The prior of the liquid's parameters."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..errors import InputError

if TYPE_CHECKING:
    from numpyro.distributions import Distribution

    from ..inference import Prior

Described = Mapping[str, Any]
"""Family and arguments of a distribution: texts, numbers, and such a table for another one."""

PARAMETERS = ("viscosity", "cohesion")
TRUNCATED = (
    "LeftTruncatedDistribution",
    "RightTruncatedDistribution",
    "TwoSidedTruncatedDistribution",
)


def split_parameters[V](theta: Mapping[str, V]) -> tuple[dict[str, V], dict[str, V]]:
    """Parameters of the liquid, and coefficients of effects."""
    liquid = {name: value for name, value in theta.items() if name in PARAMETERS}
    return liquid, {name: value for name, value in theta.items() if name not in PARAMETERS}


def default_prior() -> "Prior":
    """Every liquid from thinner than water to a stiff gel, before any stirring.

    `viscosity` [Pa s] is log-uniform from 3e-4 to 20, so that water lies inside. `cohesion` is
    uniform over its useful range, 0 to 1; stirs do not depend on it.
    """
    import numpyro.distributions as dist

    from ..inference import Prior

    return Prior({"viscosity": dist.LogUniform(3e-4, 20.0), "cohesion": dist.Uniform(0.0, 1.0)})


def describe_prior(prior: "Prior") -> dict[str, Described]:
    """Each parameter's distribution as a table of its family and arguments.

    Such as `{"family": "LogUniform", "high": 20.0, "low": 0.003}`, in which `family` is the name of
    a distribution of numpyro and the rest are its arguments.
    """
    return {name: _described(one) for name, one in prior.distributions.items()}


def read_prior(described: Mapping[str, Described]) -> "Prior":
    """The prior that `describe_prior` described.

    Raises:
        ValueError: A distribution that numpyro does not know by that name.
        TypeError: Arguments that it does not take.
    """
    from ..inference import Prior

    return Prior({name: _distribution(name, table) for name, table in described.items()})


def check_prior(prior: "Prior") -> None:
    """Raise `InputError` unless the prior is over the simulator's parameters, and can be kept."""
    from ..inference import Prior

    if not isinstance(prior, Prior):
        raise InputError(
            f"{type(prior).__name__}, expected inference.Prior",
            where="prior",
            fix='give inference.Prior({"viscosity": ..., "cohesion": ...})',
        )
    if set(prior.names) != set(PARAMETERS):
        raise InputError(
            f"parameters {', '.join(prior.names)}, expected {', '.join(PARAMETERS)}",
            where="prior",
            fix="give one distribution for each of them",
        )
    for name, distribution in prior.distributions.items():
        _check_kept(name, distribution)


def _check_kept(name: str, distribution: "Distribution") -> None:
    """Raise `InputError` unless a distribution is the same after it was written down and read."""
    import numpy as np

    from ..inference import Prior

    u = np.linspace(0.01, 0.99, 9)[:, None]
    try:
        again = read_prior({name: _described(distribution)}).from_unit(u)[name]
        same = np.allclose(again, Prior({name: distribution}).from_unit(u)[name], rtol=1e-5)
    except (AttributeError, TypeError, ValueError):
        same = False
    if not same:
        raise InputError(
            f"{type(distribution).__name__} cannot be written down by its numbers",
            where=f"prior of {name}",
            fix="give another, such as LogUniform, Uniform, Normal, TruncatedNormal, LogNormal, "
            "Beta or Gamma",
        )


def _described(distribution: "Distribution") -> Described:
    family = type(distribution).__name__
    names = sorted(distribution.arg_constraints)
    table = {name: _number(getattr(distribution, name)) for name in names}
    if family in TRUNCATED:  # by a function of numpyro, whose name is not that of a class
        base = _described(getattr(distribution, "base_dist"))  # noqa: B009  of no common type
        return {"family": "TruncatedDistribution", "base_dist": base, **table}
    return {"family": family, **table}


def _number(value: Any) -> float:
    return float(str(value))  # of a float32 its shortest text: 0.003 stays 0.003


def _distribution(name: str, table: Described) -> "Distribution":
    import numpyro.distributions as dist

    arguments = {
        key: _distribution(name, value) if isinstance(value, Mapping) else value
        for key, value in table.items()
        if key != "family"
    }
    family: Any = getattr(dist, str(table.get("family")), None)
    if family is None:
        raise ValueError(f"the prior of {name} is {dict(table)!r}, which no distribution describes")
    return family(**arguments)
