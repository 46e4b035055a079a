"""Words that the terminal, the report and the figures share: names, units and numbers."""

import shlex
from collections.abc import Iterable

LIQUID_UNITS = {"viscosity": "Pa s"}
"""Units of the liquid's parameters; the others are dimensionless."""

WHOLE_PERCENTS_FROM = 0.1
"""Fraction from which a percentage is written without decimals."""

LEAST_SPILLED = 0.0025
"""Spilled fraction that the map of landings cannot tell from 0: half of one of its parcels. Pours
that are simulated lose a few drops there."""


def spoken(name: str) -> str:
    """The name of an effect or of an explanation as it is written in a sentence."""
    return name.replace("_", " ")


def listed(names: Iterable[str], last: str = "and") -> str:
    """ "a", "a and b", "a, b and c"."""
    words = [spoken(name) for name in names]
    return f" {last} ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def unit_of(name: str) -> str:
    """Unit of an effect's coefficient or of a liquid's parameter; "" if it has none."""
    from .models import EFFECTS

    unit = EFFECTS[name].unit if name in EFFECTS else LIQUID_UNITS.get(name, "")
    return "" if unit == "1" else unit


def with_unit(name: str, value: float) -> str:
    """A coefficient or a parameter to three digits, with its unit."""
    return f"{value:.3g} {unit_of(name)}".strip()


def degrees(angle: float) -> str:
    """An angle [deg] to hundredths."""
    return f"{angle:.2f}°"


def percent(fraction: float) -> str:
    """A fraction as a percentage of two digits, without decimals above ten."""
    return f"{100 * fraction:{'.0f' if fraction >= WHOLE_PERCENTS_FROM else '.2g'}} %"


def spilled(fraction: float) -> str:
    """A spilled fraction as a percentage."""
    if fraction < LEAST_SPILLED:
        return f"under {percent(LEAST_SPILLED)}"
    return percent(fraction)


def at_most(fraction: float) -> str:
    """An upper bound of the spilled fraction."""
    return spilled(fraction) if fraction < LEAST_SPILLED else f"at most {percent(fraction)}"


def command(*words: object) -> str:
    """A command of this program, to be copied into a shell whatever blanks its paths have."""
    return shlex.join(["bolfi-liquids", *map(str, words)])
