"""The table of the fluid's bars, and that its own arithmetic is right."""

import ast
from pathlib import Path

import fluid
import numpy as np
import pytest
from bars import Line, row
from bars.pours import Table, regret

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


def bowl(rate, distance):
    return 0.002 * np.abs(rate - 90.0) / 45.0 + 0.05 * np.abs(distance - 3.0)


def test_regret_is_read_from_the_table_where_ours_is_least():
    rate, distance = (axis.ravel() for axis in np.meshgrid([45.0, 90.0, 180.0], [1.0, 3.0, 5.0]))
    table = Table(np.full(9, "oil"), rate, distance, bowl(rate, distance))
    best = regret(table, lambda tried: bowl(tried.rate, tried.distance))
    assert best == pytest.approx((0.0, 0.0))
    # ours likes a distance between two of the table's
    shifted = regret(table, lambda tried: bowl(tried.rate, tried.distance + 1.0))
    assert shifted == pytest.approx((0.05, 0.05))
    mean, worst = regret(table, lambda tried: np.zeros(len(tried.rate)))
    assert 0.0 < mean < worst == pytest.approx(0.104)


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
