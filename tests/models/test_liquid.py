import subprocess
import sys

import pytest

from bolfi_liquids import models


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("viscosity", -1.0, "viscosity.*-1"),
        ("cohesion", float("nan"), "cohesion.*nan"),
        ("density", 0.0, "density must be positive"),
        ("viscosity", [1.0, 2.0], r"viscosity has shape \(2,\).*3 simulations"),
    ],
)
def test_bad_liquids_are_named(field, value, message):
    fields = {"viscosity": 1.0, "cohesion": 0.1, "density": 1000.0, field: value}
    with pytest.raises(ValueError, match=message):
        models.Liquid(**fields).batch(3)


def test_importing_the_models_loads_neither_taichi_nor_the_engine():
    code = (
        "import sys, bolfi_liquids.models; heavy = 'taichi', 'jax', 'cv2', 'numpyro'; "
        "print([m for m in (*heavy, 'bolfi_liquids.inference') if m in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"
