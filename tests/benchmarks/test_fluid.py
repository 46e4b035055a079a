"""The table of the fluid's bars, and what its peer's scene needs."""

import ast
from pathlib import Path

import fluid
import numpy as np
import pytest
from bars import Line, row

HERE = Path(__file__).parent


@pytest.mark.benchmark
def test_every_bar():
    """Prints; run with `pytest -m benchmark -s tests/benchmarks/test_fluid.py`."""
    fluid.main([])


def test_a_line_says_whether_its_bar_is_met():
    assert row(Line("time [s]", 0.4, 0.5)).endswith("0.400   <= 0.5 met")
    assert row(Line("rank", 0.4, 0.85, least=True)).endswith(">= 0.85 NOT MET")
    assert row(Line("failed", np.nan, 0.5)).endswith("NOT MET")
    assert Line("for information", 1.0).met is None


def test_the_peer_s_scene_needs_only_old_python_and_numpy():
    tree = ast.parse((HERE / "peers/run_pysplishsplash.py").read_text(), feature_version=(3, 9))
    names = {
        alias.name.split(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
    }
    standard = {"ctypes", "json", "os", "shutil", "sys", "tempfile", "time"}
    assert names <= standard | {"numpy", "pysplishsplash"}
