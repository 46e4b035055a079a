"""Versions of the program and its libraries that a run was made with."""

import platform
from collections.abc import Iterable
from importlib.metadata import version

LIBRARIES = ("bolfi-liquids", "numpy", "scipy", "jax", "numpyro", "emcee", "taichi", "xarray")


def generations() -> dict[str, str]:
    """Of engine and model: what another one made is not to be taken for this one's."""
    from ..inference.engine_version import ENGINE_VERSION
    from ..models import MODEL_VERSION

    return {"engine": ENGINE_VERSION, "model": MODEL_VERSION}


def versions(libraries: Iterable[str]) -> dict[str, str]:
    """Of Python and the named libraries."""
    return {"python": platform.python_version()} | {name: version(name) for name in libraries}
