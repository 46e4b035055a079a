"""Values that users give and that their code returns: made what they should be, or refused by name.

Loads nothing but NumPy, for workers import it.
"""

import math
from collections.abc import Callable, Mapping
from inspect import signature
from operator import index
from typing import Any, cast

import numpy as np

LARGEST_INTEGER = 2**31 - 1  # that every random number generator takes as a seed
LARGEST_INT64 = 2**63 - 1
NUMBERS = "biufV"  # kinds of dtypes that become float64; V is bfloat16 and its like


class Unusable(ValueError):
    """Not an array of numbers, or not of the shape that is needed.

    Args:
        got: What came, in a few words.
        shape: Of the numbers that came; None where there are none.
    """

    def __init__(self, got: str, shape: tuple[int, ...] | None = None):
        super().__init__(got)
        self.got, self.shape = got, shape


def float64(value: object) -> np.ndarray:
    """`value` as a float64 array of its own; what is masked is NaN, and so are None and pandas.NA
    within it.

    Booleans and integers are numbers; a number that float64 cannot hold becomes infinite.

    Raises:
        Unusable: complex numbers, whose imaginary part would be lost; text, which would have to
            be guessed at; dates, records, rows of unequal length, None, and what is no array.
    """
    try:
        with np.errstate(all="ignore"):  # a user may have made NumPy raise
            array = np.ma.asarray(_unmasked(value))
            if array.dtype.kind == "O" and value is not None:
                return _of_objects(array)
            if array.dtype.kind in NUMBERS and array.dtype.names is None:
                # `astype` copies: a simulator may fill the same array again
                return np.ma.filled(array.astype(np.float64), np.nan)
    except (TypeError, ValueError, OverflowError) as error:
        raise Unusable(described(value)) from error
    raise Unusable(described(value))


def _unmasked(value: object) -> object:
    """Sequences of masked arrays, at any depth, without masks: NumPy would drop those of inner
    lists, and take what they hide for numbers."""
    if not isinstance(value, list | tuple):
        return _computed(value)
    inner = map(_unmasked, value)
    return [float64(one) if isinstance(one, np.ma.MaskedArray) else one for one in inner]


def _computed(value: Any) -> object:
    """Chunks of Dask in memory, also those that xarray labels: NumPy would drop their masks."""
    library = type(value).__module__.partition(".")[0]
    held = getattr(value, "data", value) if library == "xarray" else value
    lazy = type(held).__module__.startswith("dask.") and hasattr(held, "compute")
    return held.compute() if lazy else value


def _of_objects(array: np.ma.MaskedArray) -> np.ndarray:
    hidden = np.ma.getmaskarray(array).ravel()
    items = np.ma.getdata(array).ravel()
    numbers = [np.nan if out else _number(one) for one, out in zip(items, hidden, strict=True)]
    return np.array(numbers, np.float64).reshape(array.shape)


def _number(item: Any) -> float:
    if item is None or item is np.ma.masked or type(item).__name__ == "NAType":  # of pandas
        return np.nan
    if isinstance(item, str | bytes) or np.iscomplexobj(item) or np.ndim(item):
        raise TypeError("not a real number")
    try:
        return float(item)
    except OverflowError:  # an integer of hundreds of digits
        return np.inf


def described(value: object) -> str:
    """Type, shape and dtype of a value, for a message."""
    if value is None:
        return "None"
    kind = type(value).__name__
    shape, dtype = getattr(value, "shape", None), getattr(value, "dtype", None)
    if shape is not None and dtype is not None:
        return f"{shape} of {dtype}"
    if isinstance(value, str | bytes):
        return f"{kind} {value!r:.40}"
    if isinstance(value, list | tuple):
        return f"a {kind} of {len(value)}, which is no array of numbers"
    return f"an object of type {kind}"


def require(fits: object, name: str, due: str, got: object, *, cure: str = "") -> None:
    """Raise ValueError, "{name} must {due}, got {got}; {cure}", unless it fits."""
    if not fits:
        raise ValueError(f"{name} must {due}, got {got!r:.100}{cure and f'; {cure}'}")


def checked_integer(name: str, value: object, least: int = 1, most: int = LARGEST_INTEGER) -> int:
    """`value`, an integer of any library, as Python's own.

    Raises:
        ValueError: not an integer, or not from `least` to `most`.
    """
    try:
        number = index(value)  # pyright: ignore[reportArgumentType]  or TypeError
    except TypeError:
        number = least - 1
    fits = not isinstance(value, bool) and least <= number <= most
    require(fits, name, f"be an integer from {least} to {most}", value)
    return number


def checked_number(name: str, value: object, fits: Callable[[float], bool], due: str) -> float:
    """`value`, a real number of any library that fits, as Python's own.

    Args:
        name: The argument's.
        value: As a user gives it.
        fits: Whether a number is in range; NaN never is.
        due: What is in range, in words.

    Raises:
        ValueError: no number, or out of range.
    """
    try:
        array = float64(math.nan if isinstance(value, bool | np.bool_) else value)
    except Unusable:
        array = np.array(math.nan)
    number = float(array) if array.shape == () else math.nan
    require(not math.isnan(number) and fits(number), name, f"be {due}", value)
    return number


def checked_array(name: str, value: object) -> np.ndarray:
    """`value` as float64, by the rules of `float64`.

    Raises:
        ValueError: not numbers, or not of one shape.
    """
    try:
        return float64(value)
    except Unusable as error:
        raise ValueError(f"{name} must be an array of numbers, got {value!r:.100}") from error


def checked_mapping(name: str, value: object, due: str) -> dict[str, Any]:
    """`value`, a mapping of names or None, as a dictionary.

    Raises:
        ValueError: not a mapping of text.
    """
    if value is None:
        return {}
    fits = isinstance(value, Mapping) and all(isinstance(key, str) for key in value)
    require(fits, name, f"map names to {due}, or be None", value)
    return dict(cast(Mapping[str, Any], value))


def check_called(name: str, value: Any, *arguments: str) -> None:
    """Raise ValueError unless `value` can be called with so many arguments, by position."""
    try:
        called = signature(value, follow_wrapped=False)
    except (TypeError, ValueError):  # of compiled code
        return
    try:
        called.bind(*arguments)
    except TypeError as error:
        raise ValueError(
            f"{name} must be called with ({', '.join(arguments)}), got {value!r:.100}, which is "
            f"called with {called}"
        ) from error


def check_kind(name: str, value: object, kind: Any) -> None:
    """Raise ValueError unless `value` is of a kind, or of one of a union of kinds."""
    require(
        isinstance(value, kind), name, f"be of the type {getattr(kind, '__name__', kind)}", value
    )


def check_timeout(timeout: float | None) -> None:
    """Raise ValueError unless `timeout` is a positive and finite number of seconds, or None."""
    number = isinstance(timeout, int | float) and not isinstance(timeout, bool)
    fits = timeout is None or (number and 0 < timeout < math.inf)
    require(fits, "timeout", "be positive and finite [s], or None", timeout)


def check_progress(progress: object) -> None:
    """Raise ValueError unless `progress` is True, False or a function."""
    fits = isinstance(progress, bool) or callable(progress)
    require(fits, "progress", "be True, False or a function of a count", progress)


def check_flag(name: str, value: object) -> None:
    """Raise ValueError unless `value` is True or False."""
    require(isinstance(value, bool | np.bool_), name, "be True or False", value)


def check_text(name: str, value: object) -> None:
    """Raise ValueError unless `value` is text."""
    require(isinstance(value, str), name, "be text", value)


def check_identity(identity: str, keeper: str, kept: object) -> None:
    """Refuse an empty `identity` beside a store: results of another simulator would be reused."""
    due = f"name the simulator and its version where {keeper}= keeps what it returns"
    cure = 'give such as identity="decay 1.2", another with anything that changes the signals'
    require(identity or kept in (None, ":memory:"), "identity", due, identity, cure=cure)


def check_function(name: str, value: object) -> None:
    """Raise ValueError unless `value` is a function."""
    require(callable(value), name, "be a function", value)


def check_callable(name: str, value: object) -> None:
    """Raise ValueError unless `value` is a function or None."""
    require(value is None or callable(value), name, "be a function or None", value)


def check_choice(name: str, value: object, choices: tuple[str | None, ...]) -> None:
    """Raise ValueError unless `value` is one of `choices`, texts or None."""
    fits = isinstance(value, str | None) and value in choices
    require(fits, name, f"be one of {choices}", value)


def check_runs(name: str, runs: Any, *lengths: int) -> None:
    """Raise ValueError unless `runs` is None or a tuple (theta, signals, seeds, errors), cut to one
    of these lengths."""
    held = isinstance(runs, tuple | list) and len(runs) in lengths and is_table(runs[0])
    parts = "theta", "signals", "seeds", "errors"
    forms = " or ".join(f"({', '.join(parts[:length])})" for length in lengths)
    due = f"be {forms}, theta a mapping of names to values, or None"
    require(runs is None or held, name, due, runs)


def is_table(value: object) -> bool:
    """Whether `value` has columns by name: a mapping, a data frame, a dataset."""
    return hasattr(value, "keys") and hasattr(value, "__getitem__")
