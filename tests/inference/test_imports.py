"""What importing loads, and which names it finds."""

import contextlib
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

HEAVY = "taichi", "cv2", "pandas", "matplotlib", "xarray.core", "arviz_base", "arviz_stats", "emcee"


@pytest.mark.parametrize(
    ("imported", "light"),
    [
        ("import bolfi_liquids.inference", [*HEAVY, "jax", "numpyro", "scipy"]),
        (
            "from bolfi_liquids import inference; [getattr(inference, n) for n in dir(inference)]",
            [*HEAVY, "rich", "rtde_control", "scipy.stats._stats"],
        ),
    ],
)
def test_importing_loads_only_what_is_used(imported, light):
    code = f"import sys; {imported}; print([name for name in {light} if name in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=Path("/"), check=True
    )
    assert done.stdout.strip() == "[]"


FACES = ["", ".inference", ".inference.checks", ".inference.criticism", ".inference.simulations"]
FACES += [".inference.surrogates", ".hardware", ".hardware.motion", ".hardware.vision"]


def test_every_public_name_is_there():
    """Also where a submodule of the same name was imported before, which must not hide it."""
    hidden = []
    for package in (import_module(f"bolfi_liquids{face}") for face in FACES):
        for name in package.__all__:
            found = getattr(package, name)
            if name == getattr(found, "__name__", None):  # a function or class, not a module
                with contextlib.suppress(ModuleNotFoundError):
                    import_module(f"{package.__name__}.{name}")
                hidden += [(package, name)] if getattr(package, name) is not found else []
        assert not hasattr(package, "nothing")
    assert not hidden
