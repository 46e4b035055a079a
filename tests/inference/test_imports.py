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
        ("from bolfi_liquids.inference import fit, Prior", [*HEAVY, "rich", "scipy.stats._stats"]),
        ("import bolfi_liquids.inference", [*HEAVY, "jax", "numpyro", "scipy"]),
        (
            "from bolfi_liquids import inference; [getattr(inference, n) for n in dir(inference)]",
            [*HEAVY, "rtde_control", "scipy.stats._stats"],
        ),
    ],
)
def test_importing_loads_only_what_is_used(imported, light):
    code = f"import sys; {imported}; print([name for name in {light} if name in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=Path("/"), check=True
    )
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    "face",
    ["", ".inference", ".inference.checks", ".inference.criticism", ".inference.simulations"]
    + [".inference.surrogates", ".hardware", ".hardware.motion", ".hardware.vision"],
)
def test_every_public_name_is_there(face):
    """Also where a submodule of the same name was imported before, which must not hide it."""
    package = import_module(f"bolfi_liquids{face}")
    for name in package.__all__:
        found = getattr(package, name)
        if name == getattr(found, "__name__", None):  # a function or class, not a module
            with contextlib.suppress(ModuleNotFoundError):
                import_module(f"{package.__name__}.{name}")
            assert getattr(package, name) is found
    with pytest.raises(AttributeError, match="nothing"):
        package.nothing  # noqa: B018
