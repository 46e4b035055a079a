"""The prior of the liquid's parameters."""

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeVar

from ..errors import InputError

if TYPE_CHECKING:
    from ..inference import Prior

PARAMETERS = ("viscosity", "cohesion")
V = TypeVar("V")


def split_parameters(theta: Mapping[str, V]) -> tuple[dict[str, V], dict[str, V]]:
    """Parameters of the liquid, and coefficients of effects."""
    liquid = {name: value for name, value in theta.items() if name in PARAMETERS}
    return liquid, {name: value for name, value in theta.items() if name not in PARAMETERS}


def default_prior() -> "Prior":
    """Every liquid that the simulator can tell from another, before any stirring.

    `viscosity` [Pa s] is log-uniform from 3e-3 to a stiff gel's 20. Below, the dissipation of
    the particle fluid itself rules: 1e-3 and 3e-3 differ by no more than two seeds of either do,
    so water is whatever lies at this end. `cohesion` is uniform over its useful range, 0 to 1.
    """
    import numpyro.distributions as dist

    from ..inference import Prior

    return Prior({"viscosity": dist.LogUniform(3e-3, 20.0), "cohesion": dist.Uniform(0.0, 1.0)})


_DESCRIBED = re.compile(r"(\w+)\((.*)\)")


def read_prior(described: Mapping[str, str]) -> "Prior":
    """The prior that `describe_prior` described.

    Raises:
        ValueError: a distribution that numpyro does not know by that name.
    """
    import numpyro.distributions as dist

    from ..inference import Prior

    distributions = {}
    for name, text in described.items():
        found = _DESCRIBED.fullmatch(text)
        made = getattr(dist, found[1], None) if found else None
        if found is None or made is None:
            raise ValueError(f"the prior of {name} is {text!r}, which no distribution describes")
        pairs = (pair.split("=") for pair in found[2].split(", ") if pair)
        distributions[name] = made(**{key: float(value) for key, value in pairs})
    return Prior(distributions)


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
    for name, text in describe_prior(prior).items():
        try:
            read_prior({name: text})
        except (TypeError, ValueError) as err:
            raise InputError(
                f"{text.partition('(')[0]} cannot be written down by its numbers",
                where=f"prior of {name}",
                fix="give another, such as LogUniform, Uniform, Normal, LogNormal, Beta or Gamma",
            ) from err


def describe_prior(prior: "Prior") -> dict[str, str]:
    """Each parameter's distribution and its arguments, as text."""
    return {
        name: f"{type(distribution).__name__}("
        + ", ".join(f"{k}={getattr(distribution, k)}" for k in sorted(distribution.arg_constraints))
        + ")"
        for name, distribution in prior.distributions.items()
    }
