"""Numbers as people write them, read without guessing."""

import math
import re

_NUMERAL = r"[+-]?(\d+{sign}?\d*|{sign}\d+)([eE][+-]?\d+)?"
_NUMERALS = {
    sign: re.compile(_NUMERAL.format(sign=re.escape(sign)), re.ASCII) for sign in (".", ",")
}
_WITH_DECIMALS = {
    sign: re.compile(rf"[+-]?\d*{re.escape(sign)}\d+([eE][+-]?\d+)?", re.ASCII)
    for sign in (".", ",")
}
_MAYBE_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)


def parse_number(text: str, decimal: str = ".") -> float:
    """The number that a text is, blanks around it aside.

    Python reads more than that: digits of other scripts, `3_0`, `infinity`, and 1e999 as infinite.

    Args:
        text: Digits 0 to 9, with a sign, a decimal sign and an exponent where there are such.
        decimal: "." or ",".

    Raises:
        ValueError: The text is something else, or larger than a number may be.
    """
    text = text.strip()
    if not _NUMERALS[decimal].fullmatch(text):
        raise ValueError(f"{text!r:.40} is no number")
    number = float(text.replace(decimal, "."))
    if not math.isfinite(number):
        raise ValueError(f"{text!r:.40} is too large for a number")
    return number


def has_decimals(text: str, decimal: str) -> bool:
    """Whether a text is a number with digits behind this decimal sign."""
    return bool(_WITH_DECIMALS[decimal].fullmatch(text.strip()))


def may_have_thousands(text: str) -> bool:
    """Whether the comma in a number may stand for thousands as well: 1,234."""
    return bool(_MAYBE_THOUSANDS.fullmatch(text.strip()))
