"""Numbers and arrays as JSON gives them back."""

import math
from collections.abc import Mapping
from typing import Any


def plain(value: Any) -> Any:
    """Lists for arrays and tuples, null for what is not finite.

    Raises:
        TypeError: something else than numbers, text, and mappings and sequences of them.
    """
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if not isinstance(value, str | int | float | None):
        raise TypeError(f"a case's settings and notes must be numbers and text, got {value!r}")
    return None if isinstance(value, float) and not math.isfinite(value) else value
