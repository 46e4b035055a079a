"""Extensions that are named on pytest's command line."""

import importlib
import sys
from pathlib import Path
from typing import Any


def named(text: str) -> Any:
    """The object that `module:name` means; the module may lie where pytest was started."""
    sys.path.insert(0, str(Path.cwd()))
    module, _, name = text.partition(":")
    return getattr(importlib.import_module(module), name)
