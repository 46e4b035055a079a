"""JAX's compilations are cached between commands, each of which would compile for 10 to 25 s."""

import os
import platform
import warnings

from platformdirs import user_cache_path

from ..home import is_temporary


def keep_compilations() -> None:
    """Have JAX cache compilations in the user's cache, for this process and those it starts.

    Call it before anything imports JAX. If the environment names a directory
    (`JAX_COMPILATION_CACHE_DIR`), it is used. If there is no home directory, or it is not
    writable, nothing is cached.
    """
    ignore_torn_entries()
    if "JAX_COMPILATION_CACHE_DIR" in os.environ:
        return
    # compiled for this computer's processor, and a home directory may be shared
    home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("HOME", "")
    if is_temporary(home):
        return
    try:
        place = user_cache_path("bolfi-liquids") / "jax" / (platform.node() or "here")
        place.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # the latter where platformdirs finds no home
        return
    if not os.access(place, os.W_OK):
        return
    os.environ["JAX_COMPILATION_CACHE_DIR"] = str(place)
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")


def ignore_torn_entries() -> None:
    """JAX recompiles truncated cache entries. Its warning about them is suppressed in this
    process."""
    warnings.filterwarnings("ignore", "Error (reading|writing) persistent compilation cache")
