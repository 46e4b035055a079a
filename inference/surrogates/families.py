"""The family that a user means: an object, a name, or what the options belong to."""

from collections.abc import Callable, Iterable
from dataclasses import fields
from difflib import get_close_matches
from inspect import signature
from typing import Any, cast

from ..arguments import check_called
from .base import Family, Surrogate
from .discrepancy import DiscrepancyFamily
from .log_likelihood import LogLikelihoodFamily
from .signal import SignalFamily

FAMILIES: dict[str, Any] = {
    "discrepancy": DiscrepancyFamily,
    "signal": SignalFamily,
    "log_likelihood": LogLikelihoodFamily,
}
"""Dataclasses by the name that users give; any other `Family` is given as an object."""


def resolve(surrogate: str | Family | None, options: dict[str, Any]) -> Family:
    """The family that `fit`'s arguments `surrogate` and `options` name.

    None is "signal", unless a discrepancy, or another option of that family alone, is given.

    Raises:
        ValueError: unknown name, no `Family`, an option that the family has not, or without a
            name a discrepancy and an option of "signal".
    """
    if Family in type(surrogate).__mro__:
        if options:
            raise ValueError(
                f"an object takes its own options: give {', '.join(options)} to "
                f"{type(surrogate).__name__}(...) itself"
            )
        family = cast(Family, surrogate)
        check_called("learn of surrogate", family.learn, "data", "key")
        return family
    if surrogate is None:
        for_discrepancy = (option_names("discrepancy") - option_names("signal")) | {"discrepancy"}
        for_signal = option_names("signal") - option_names("discrepancy")
        given = {name for name, value in options.items() if value is not None}
        of_paper, of_signal = for_discrepancy & given, for_signal & given
        if "discrepancy" in of_paper and of_signal:
            raise ValueError(
                f"discrepancy and {', '.join(sorted(of_signal))} belong to two surrogates: leave "
                'one out, or say surrogate="signal", to which a discrepancy only ranks simulations'
            )
        surrogate = "discrepancy" if of_paper and not of_signal else "signal"
        options = {
            n: v for n, v in options.items() if v is not None or n in option_names(surrogate)
        }
    if surrogate not in tuple(FAMILIES):
        raise ValueError(
            f"surrogate must be one of {tuple(FAMILIES)}, an object of a class whose base is "
            f"`Family`, or None, got {surrogate!r:.100}"
        )
    own = sorted(option_names(surrogate))
    for unknown in sorted(options.keys() - {*own}):
        of = [name for name in FAMILIES if unknown in option_names(name)] or "none"
        raise ValueError(
            f"{unknown} is an option of the surrogate {of}, not of {surrogate!r}, which has {own}"
        )
    return FAMILIES[str(surrogate)](**options)


def check_options(options: Iterable[str], of: Callable[..., Any]) -> None:
    """Raise ValueError for options that are neither arguments of a function nor any surrogate's."""
    own = [name for name in signature(of).parameters if name not in ("self", "options")]
    of_families = sorted(set().union(*map(option_names, FAMILIES)))
    for unknown in sorted(set(options) - {*own, *of_families}):
        near = " or ".join(get_close_matches(unknown, [*own, *of_families]))
        raise ValueError(
            f"there is no argument {unknown}{near and f'; do you mean {near}?'} There are "
            f"{', '.join(own)}, and of the surrogates {', '.join(of_families)}"
        )


def option_names(name: Any) -> set[str]:
    """Names of the options that the family of this name has."""
    return {field.name for field in fields(FAMILIES[name])}


def checked_surrogate(found: Any, family: Family) -> Surrogate:
    """What a family learned.

    Raises:
        ValueError: it has not all members of `Surrogate`.
    """
    members = {*Surrogate.__annotations__, *vars(Surrogate)}
    public = sorted(name for name in members if not name.startswith("_"))
    # no property is evaluated
    missing = [name for name in public if not (hasattr(type(found), name) or hasattr(found, name))]
    if missing:
        raise ValueError(
            f"{type(family).__name__} must learn a Surrogate, got {type(found).__name__} without "
            f"{', '.join(missing)}; derive its class from `Surrogate`, and write these"
        )
    return found
