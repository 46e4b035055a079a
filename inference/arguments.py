"""Arguments as users give them: made what they should be, or refused by name."""

import math

import numpy as np

LARGEST_INTEGER = 2**31 - 1  # that every random number generator takes as a seed


def checked_integer(name: str, value: object, least: int = 1) -> int:
    """`value` as int.

    Raises:
        ValueError: not an integer, or not from `least` to `LARGEST_INTEGER`.
    """
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        number = int(value)
        if least <= number <= LARGEST_INTEGER:
            return number
    raise ValueError(f"{name} must be an integer from {least} to {LARGEST_INTEGER}, got {value!r}")


def checked_array(name: str, value: object) -> np.ndarray:
    """`value` as float64.

    Raises:
        ValueError: not numbers, or not of one shape.
    """
    try:
        array = np.ma.asarray(value)
        if array.dtype.kind == "c":
            raise TypeError("complex")
        return np.ma.filled(array.astype(np.float64), np.nan)  # what is masked is missing
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be an array of numbers, got {value!r:.100}") from error


def check_timeout(timeout: float | None) -> None:
    """Raise ValueError unless `timeout` is a positive and finite number of seconds, or None."""
    number = isinstance(timeout, int | float) and not isinstance(timeout, bool)
    if timeout is not None and not (number and 0 < timeout < math.inf):
        raise ValueError(f"timeout must be positive and finite [s], or None, got {timeout!r}")


def check_progress(progress: object) -> None:
    """Raise ValueError unless `progress` is True, False or a function."""
    if not (isinstance(progress, bool) or callable(progress)):
        raise ValueError(
            f"progress must be True, False or a function of a count, got {progress!r:.100}"
        )


def check_text(name: str, value: object) -> None:
    """Raise ValueError unless `value` is text."""
    if not isinstance(value, str):
        raise ValueError(f"{name} must be text, got {value!r:.100}")


def check_function(name: str, value: object) -> None:
    """Raise ValueError unless `value` is a function."""
    if not callable(value):
        raise ValueError(f"{name} must be a function, got {value!r:.100}")


def check_callable(name: str, value: object) -> None:
    """Raise ValueError unless `value` is a function or None."""
    if value is not None and not callable(value):
        raise ValueError(f"{name} must be a function or None, got {value!r:.100}")


def checked_points(u: object, dimension: int) -> np.ndarray:
    """Prior quantiles u as float64 [n, dimension].

    Raises:
        ValueError: of another shape.
    """
    points = checked_array("u", u)
    if points.ndim != 2 or points.shape[1] != dimension:
        raise ValueError(
            f"u must have shape [n, {dimension}], a row of prior quantiles for each point, "
            f"got {points.shape}"
        )
    return points
