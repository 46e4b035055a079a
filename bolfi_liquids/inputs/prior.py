"""The prior of the liquid's parameters."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from .described_liquid import MAX_VISCOSITY

if TYPE_CHECKING:
    from numpyro.distributions import Distribution

    from ..inference import Prior
    from ..inference.distributions import Table

PARAMETERS = {"viscosity": (0.0, MAX_VISCOSITY), "cohesion": (0.0, 1.0)}
"""The simulator's parameters, and where it is defined."""

TAIL = 1e-3
"""Mass of a prior that may lie beyond on either side."""


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


def describe_prior(prior: "Prior") -> dict[str, "Table"]:
    """Each parameter's distribution as a table of its family and arguments."""
    from ..inference.distributions import to_table

    return {name: to_table(one) for name, one in prior.distributions.items()}


def read_prior(described: "Mapping[str, Table]") -> "Prior":
    """The prior that `describe_prior` described.

    Raises:
        ValueError: A distribution that numpyro does not know by that name.
        TypeError: Arguments that it does not take.
    """
    from ..inference import Prior
    from ..inference.distributions import from_table

    return Prior({name: from_table(table) for name, table in described.items()})


def check_prior(prior: "Prior") -> None:
    """Raise `InputError` unless a prior is over the simulator's parameters, and can be kept."""
    for where, what, fix in _faults(prior):
        raise InputError(what, where=where, fix=fix)


def _faults(prior: Any) -> Iterator[tuple[str, str, str]]:
    """Place, fault and remedy of what speaks against a prior."""
    from ..inference import Prior

    given = ", ".join(prior.names) if isinstance(prior, Prior) else type(prior).__name__
    if not isinstance(prior, Prior) or set(prior.names) != set(PARAMETERS):
        fix = 'give inference.Prior({"viscosity": ..., "cohesion": ...})'
        yield "prior", f"{given}, expected inference.Prior of {', '.join(PARAMETERS)}", fix
    tails = np.array([[TAIL], [1.0 - TAIL]])
    for name, distribution in prior.distributions.items():
        family, (least, most) = type(distribution).__name__, PARAMETERS[name]
        low, high = Prior({name: distribution}).from_unit(tails)[name]
        if not least <= low <= high <= most:
            what = f"{family} goes from {low:.3g} to {high:.3g}"
            fix = f"give one within {least:g} to {most:g}, such as a LogUniform or TruncatedNormal"
            yield f"prior of {name}", what, fix
        if not _is_kept(name, distribution):
            fix = "give another, such as LogUniform, Uniform, TruncatedNormal, LogNormal or Beta"
            yield f"prior of {name}", f"{family} cannot be written down by its numbers", fix


def _is_kept(name: str, distribution: "Distribution") -> bool:
    """Whether a distribution is the same after it was written down and read."""
    from ..inference import Prior

    alone = Prior({name: distribution})
    u = np.linspace(0.01, 0.99, 9)[:, None]
    try:
        again = read_prior(describe_prior(alone)).from_unit(u)[name]
    except (AttributeError, TypeError, ValueError):
        return False
    return bool(np.allclose(again, alone.from_unit(u)[name], rtol=1e-5))
