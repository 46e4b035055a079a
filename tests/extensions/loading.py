"""Objects of modules that are named on pytest's command line, and of the examples beside it."""

import importlib
import importlib.util
import sys
from pathlib import Path
from typing import Any


def named(text: str) -> Any:
    """The object that `module:name` means; the module may lie where pytest was started."""
    sys.path.insert(0, str(Path.cwd()))
    module, _, name = text.partition(":")
    return getattr(importlib.import_module(module), name)


def beside(module: str, name: str) -> Any:
    """The object `name` of an example's file."""
    path = Path(__file__).with_name(f"{module}.py")
    spec = importlib.util.spec_from_file_location(module, path)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return getattr(loaded, name)
