"""Where Taichi is not installed, the fluid says so in a sentence, and the engine works."""

import subprocess
import sys

from bolfi_liquids.guide import read_page

CODE = """
import sys
sys.modules["taichi"] = None
from bolfi_liquids import inference, models
inference.fit, inference.Prior, models.MODEL_VERSION
from bolfi_liquids.models import runtime
try:
    runtime.start()
except ImportError as error:
    print(f"ImportError: {error}")
"""


def test_the_fluid_names_what_is_missing():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("ImportError: the fluid needs Taichi")
    assert f"`{done.stdout.strip()}`" in read_page("troubleshooting")
