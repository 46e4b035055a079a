"""Code that starts Taichi beside the simulator is refused before anything is harmed."""

import subprocess
import sys

import pytest

BEGIN = """
import taichi as ti
from bolfi_liquids.models import runtime

def entered():
    try:
        with runtime.LOCK:
            runtime.start()
    except runtime.ForeignTaichi as error:
        return f"refused: {error}"
    return "entered"
"""
CASES = {
    "nothing": ("pass", "entered"),
    "ti.init": ("ti.init(ti.cpu)", "refused: Taichi was started or reset by other code"),
    "ti.reset": ("ti.reset()", "refused: Taichi was started or reset by other code"),
}


def lines(code):
    done = subprocess.run(
        [sys.executable, "-P", "-c", BEGIN + code], capture_output=True, text=True, check=True
    )
    return [line for line in done.stdout.splitlines() if line.startswith(("entered", "refused"))]


@pytest.mark.parametrize("case", CASES)
def test_taichi_started_between_two_simulations_is_refused(case):
    """As often as it is tried: a refusal leaves the lock free."""
    between, said = CASES[case]
    first, second, third = lines(f"print(entered())\n{between}\nprint(entered())\nprint(entered())")
    assert first == "entered" and second == third and second.startswith(said)
    assert case == "nothing" or "simulate in another process" in second


def test_taichi_that_others_started_before_keeps_its_fields():
    (said, kept) = lines(
        """
ti.init(ti.cpu)
own = ti.field(ti.f32, 3)
own[1] = 7.0
print(entered())
print("entered" if own[1] == 7.0 else "lost")
"""
    )
    assert said.startswith("refused: Taichi was started by other code before") and kept == "entered"
