"""Keep JAX's compiled programs in the user's cache directory."""

import os
import platform
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import Lock

import jax
from jax.experimental.compilation_cache import compilation_cache
from platformdirs import user_cache_path

PLACE = "jax_compilation_cache_dir"
LEAST = {  # everything is kept
    "jax_persistent_cache_min_compile_time_secs": 0.0,
    "jax_persistent_cache_min_entry_size_bytes": 0,
}
_alone = Lock()  # JAX's settings belong to the process


@contextmanager
def kept_compilations() -> Iterator[None]:
    """Have JAX keep what is compiled within in the user's cache directory.

    A directory that the user chose, by `JAX_COMPILATION_CACHE_DIR` or by JAX's own setting, is used
    as it is. JAX's settings are afterwards what they were. A cache that cannot be written or read
    is done without.
    """
    with _alone, warnings.catch_warnings():
        # JAX recompiles truncated entries
        warnings.filterwarnings("ignore", "Error (reading|writing) persistent compilation cache")
        before = {name: getattr(jax.config, name) for name in (PLACE, *LEAST)}
        place = _directory() if before[PLACE] is None else None
        if place is None:
            yield
            return
        try:
            _configure({PLACE: str(place), **LEAST})
            yield
        finally:
            _configure(before)


def _configure(settings: Mapping[str, object]) -> None:
    for name, value in settings.items():
        jax.config.update(name, value)
    compilation_cache.reset_cache()  # JAX looks at its settings when it first compiles


def _directory() -> Path | None:
    """A directory for this computer, for a home directory may be shared; None where none can be
    written."""
    try:
        place = user_cache_path("bolfi-liquids") / "jax" / (platform.node() or "here")
        place.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # the latter where platformdirs finds no home
        return None
    return place if os.access(place, os.W_OK) else None
