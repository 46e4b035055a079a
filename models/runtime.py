"""The one place that starts Taichi."""

import contextlib
import io
import os
import threading
from functools import cache

SLOTS = max(8, os.cpu_count() or 1)  # simulations of a scene side by side
CHUNK = 240  # substeps a kernel call, so that Ctrl-C is prompt

LOCK = threading.Lock()
"""Held while a scene runs: Taichi's runtime and a scene's fields serve one thread at a time."""


@cache
def start() -> None:
    """Start Taichi on the CPU; later calls in the same process do nothing.

    Taichi keeps its settings for the life of a process, so other settings need another process.
    """
    os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")
    import taichi as ti

    # the banner is a bare print that no log level silences
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(arch=ti.cpu, default_fp=ti.f32, log_level=ti.ERROR)
