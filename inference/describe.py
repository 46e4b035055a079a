"""Text that says what a function or an option is, the same in every process that makes it anew."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from typing import Any

import numpy as np
import numpyro.distributions as dist

from .prior import Prior

ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")


def describe(value: Any) -> str:
    """Module and name of functions, fields of dataclasses and named tuples, parameters of priors,
    shape and a hash of arrays; `repr` of the rest.

    It knows nothing of what a function does: code that changed under one name reads the same.
    """
    if isinstance(value, Prior):
        return f"Prior({describe(value.distributions)})"
    if isinstance(value, dist.Distribution):
        given = {name: getattr(value, name) for name in value.arg_constraints}
        return f"{type(value).__name__}({describe(given)})"
    if isinstance(value, partial):
        return (
            f"partial({describe(value.func)}, {describe(value.args)}, {describe(value.keywords)})"
        )
    if is_dataclass(value) and not isinstance(value, type):
        held = {field.name: getattr(value, field.name) for field in fields(value)}
        return f"{_name(type(value))}({describe(held)})"
    if callable(value) and hasattr(value, "__qualname__"):
        return _name(value)
    return _plain(value)


def _plain(value: Any) -> str:
    if hasattr(value, "_asdict"):  # a named tuple
        return f"{_name(type(value))}({describe(value._asdict())})"
    if isinstance(value, Mapping):
        return ", ".join(f"{key}={describe(value[key])}" for key in value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(describe, value))}]"
    if hasattr(value, "__array__"):
        array = np.asarray(value)
        if array.ndim == 0:
            return repr(array.item())
        digest = hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]
        return f"array({array.dtype}, {array.shape}, {digest})"
    return ADDRESS.sub("", repr(value))


def _name(value: Any) -> str:
    return f"{value.__module__}.{value.__qualname__}"
