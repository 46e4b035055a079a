"""Checks of numbers that a person gives."""

import math

import numpy as np
from numpy.typing import ArrayLike


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


def checked_batch(what: str, value: ArrayLike, size: int) -> np.ndarray:
    """A number, or one for each of `size` simulations, as an array of shape [size].

    Raises:
        ValueError: it is something else, not finite, or of another shape.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as err:
        raise ValueError(f"{what} must be a number or an array, got {value!r}") from err
    if array.ndim > 1 or array.size not in (1, size):
        raise ValueError(
            f"{what} has shape {array.shape}, but there are {size} simulations; "
            f"give a scalar or an array of shape ({size},)"
        )
    if not np.isfinite(array).all():
        raise ValueError(f"{what} must be finite, got {value!r}")
    return np.broadcast_to(array, (size,))


def checked_seeds(seeds: ArrayLike) -> np.ndarray:
    """Seeds as an array of shape [B].

    Raises:
        ValueError: there is none, or one is no integer or negative.
    """
    array = np.atleast_1d(np.asarray(seeds))
    if array.size == 0 or array.ndim > 1 or array.dtype.kind not in "iu" or (array < 0).any():
        raise ValueError(f"seeds must be integers of at least 0, one a simulation, got {seeds}")
    return array
