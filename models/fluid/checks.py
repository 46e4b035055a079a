"""Checks of numbers that a person gives."""

import math


def check_numbers(what: str, *, zero: bool = False, **numbers: float) -> None:
    """Refuse what is not finite and positive; 0 passes if `zero`.

    Raises:
        ValueError: names what the number belongs to, the number and its value.
    """
    for name, value in numbers.items():
        wanted = "not negative" if zero else "positive"
        try:
            fine = math.isfinite(value) and (value > 0 or (zero and value == 0))
        except TypeError:
            fine = False
        if not fine:
            raise ValueError(f"{what}: {name} must be a number, finite and {wanted}, got {value!r}")
