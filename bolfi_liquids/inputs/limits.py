"""Numbers that a person gives, and the limits that each of them has."""

import math
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError

INF, ABOVE_0, BELOW_1 = np.inf, float(np.finfo(float).tiny), float(np.nextafter(1.0, 0.0))


class Limits(NamedTuple):
    """Limits of a quantity, both allowed, and the remedy beyond them.

    Attributes:
        quantity: Its name; "" where the place of a fault names it.
        least: The smallest value allowed.
        most: The largest value allowed.
        unit: Of value and limits.
        fix: The remedy.
    """

    quantity: str
    least: float
    most: float
    unit: str
    fix: str

    def check(self, value: float, where: str, note: str = "") -> None:
        """Raise `InputError` unless the value lies within; NaN does not.

        Args:
            value: In `unit`.
            where: Place of the fault.
            note: How the value came about.
        """
        if self.least <= value <= self.most:
            return
        found = f"{self.quantity} = {value:.6g} {self.unit}".strip(" =")
        allowed = f"{self.span()} {self.unit}".rstrip()
        raise InputError(f"{found}{note}, {allowed} allowed", where=where, fix=self.fix)

    def span(self) -> str:
        """Both limits, without the unit."""
        if self.least == ABOVE_0:
            return f"above 0 to {self.most:g}"
        if not np.isfinite(self.most):
            return f"at least {self.least:g}"
        return f"{self.least:g}" if self.least == self.most else f"{self.least:g} to {self.most:g}"


def checked_number(value: Any, where: str) -> float:
    """A value that must be one number.

    Raises:
        InputError: It is something else; `where` is named.
    """
    if not math.isfinite(number := as_number(value)):
        given = " ".join(repr(value).split())
        raise InputError(f"{given:.80}", where=where, fix="give one finite number")
    return number


def as_number(value: Any) -> float:
    """The value, which may be an array without axes; NaN where it is no number."""
    plain = value.item() if getattr(value, "shape", None) == () else value
    return float(plain) if isinstance(plain, Real) and not isinstance(plain, bool) else math.nan
