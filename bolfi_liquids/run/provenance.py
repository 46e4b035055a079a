"""Versions of the program and its libraries that a run was made with."""

import platform
from importlib.metadata import version

LIBRARIES = ("bolfi-liquids", "numpy", "scipy", "jax", "numpyro", "emcee", "taichi", "xarray")


def generations() -> dict[str, str]:
    """Versions of engine and model; results of another version are other results."""
    from ..inference.engine_version import ENGINE_VERSION
    from ..models import MODEL_VERSION

    return {"engine": ENGINE_VERSION, "model": MODEL_VERSION}


def versions() -> dict[str, str]:
    """Versions of Python, the program and its libraries."""
    return {"python": platform.python_version()} | {name: version(name) for name in LIBRARIES}
