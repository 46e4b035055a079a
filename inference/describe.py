"""Text descriptions of functions and options, identical in every process."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
import numpyro.distributions as dist

from .distributions import describe as describe_distribution
from .prior import Prior

OWN = __name__.partition(".")[0]
ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")


def describe(value: Any) -> str:
    """Module and name of functions, fields of dataclasses and named tuples, parameters of priors,
    shape and a hash of arrays; `repr` of the rest. Fields that do not compare are left out.

    It knows nothing of what a function does: code that changed under one name reads the same.
    """
    if isinstance(value, Prior):
        return f"Prior({describe(value.model or value.distributions)})"
    if isinstance(value, dist.Distribution):
        return describe_distribution(value)
    if isinstance(value, partial):
        return (
            f"partial({describe(value.func)}, {describe(value.args)}, {describe(value.keywords)})"
        )
    if is_dataclass(value) and not isinstance(value, type):
        held = {field.name: getattr(value, field.name) for field in fields(value) if field.compare}
        return f"{_name(type(value))}({describe(held)})"
    if callable(value) and hasattr(value, "__qualname__"):
        return _name(value) + _held(value)
    return _plain(value)


def _held(function: Any) -> str:
    """Object of a method, or variables of a closure, in brackets; "" for a plain function."""
    code, cells = getattr(function, "__code__", None), getattr(function, "__closure__", None) or ()
    names = code.co_freevars if code else ()
    # a function that calls itself is among its own cells
    own = getattr(function, "__name__", None)
    held = [cell.cell_contents for name, cell in zip(names, cells, strict=True) if name != own]
    bound = getattr(function, "__self__", None)
    if bound is not None and not isinstance(bound, ModuleType):
        held = [bound, *held]
    return f"[{', '.join(map(describe, held))}]" if held else ""


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
    """Module and name; of this package without the module's place, which is no part of what is
    kept: a module that moves orphans nothing."""
    module = value.__module__
    place = OWN if module.startswith(f"{OWN}.") else module
    return f"{place}.{value.__qualname__}"
