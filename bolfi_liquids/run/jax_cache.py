"""What JAX compiles for the commands is kept: without it, each compiles for 10 to 25 seconds."""

import os
import platform
import warnings

from platformdirs import user_cache_path


def keep_compilations() -> None:
    """Have JAX keep what it compiles in the user's cache, for this process and those it starts.

    Call it before anything imports JAX. Where the environment names another place
    (`JAX_COMPILATION_CACHE_DIR`), that is taken; a cache that cannot be written is done without.
    """
    ignore_torn_entries()
    if "JAX_COMPILATION_CACHE_DIR" in os.environ:
        return
    # compiled for this computer's processor, and a home directory may be shared
    place = user_cache_path("bolfi-liquids") / "jax" / (platform.node() or "here")
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    if not os.access(place, os.W_OK):
        return
    os.environ["JAX_COMPILATION_CACHE_DIR"] = str(place)
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")


def ignore_torn_entries() -> None:
    """JAX compiles again what it finds cut short, by a kill or by another process that still
    writes; that it warns of it helps nobody. For this process only."""
    warnings.filterwarnings("ignore", "Error (reading|writing) persistent compilation cache")
