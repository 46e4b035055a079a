"""The family that a user means: an object, a name, or what the options belong to."""

from dataclasses import fields
from typing import Any, cast

from ..arguments import check_called
from .base import Family
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
            raise ValueError(f"give {tuple(options)} to {surrogate!r} itself")
        family = cast(Family, surrogate)
        check_called("learn of surrogate", family.learn, "data", "key")
        return family
    if surrogate is None:
        for_discrepancy = (_options("discrepancy") - _options("signal")) | {"discrepancy"}
        for_signal = _options("signal") - _options("discrepancy")
        given = {name for name, value in options.items() if value is not None}
        of_paper, of_signal = for_discrepancy & given, for_signal & given
        if "discrepancy" in of_paper and of_signal:
            raise ValueError(
                f"discrepancy and {', '.join(sorted(of_signal))} belong to two surrogates: leave "
                'one out, or say surrogate="signal", to which a discrepancy only ranks simulations'
            )
        surrogate = "discrepancy" if of_paper and not of_signal else "signal"
        options = {n: v for n, v in options.items() if v is not None or n in _options(surrogate)}
    if surrogate not in tuple(FAMILIES):
        raise ValueError(
            f"surrogate must be one of {tuple(FAMILIES)}, an object of a class whose base is "
            f"`Family`, or None, got {surrogate!r:.100}"
        )
    unknown = options.keys() - _options(surrogate)
    if unknown:
        raise ValueError(
            f"there is no argument {', '.join(sorted(unknown))}; the surrogate {surrogate!r} has "
            f"the options {tuple(sorted(_options(surrogate)))}"
        )
    return FAMILIES[str(surrogate)](**options)


def _options(name: Any) -> set[str]:
    return {field.name for field in fields(FAMILIES[name])}
