"""The comparison's own machinery: what resumes, what is stale, what the peers can read."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from report import report

HERE = Path(__file__).parent
FOREIGN = [*(HERE / "tasks").glob("*.py"), HERE / "peers/job.py"]
PEERS = {"elfi": {"elfi"}, "sbi": {"sbi", "torch"}}


def imported(tree):
    """Packages that a module imports, those beside it left out."""
    names = {"collections", "contextlib", "dataclasses", "io", "json", "os"}
    names |= {"pathlib", "sys", "time", "typing", "__future__", "tasks"}
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        if isinstance(node, ast.ImportFrom) and node.level == 0:
            found.add(node.module.split(".")[0])
    return found - names


def test_what_runs_beside_peers_needs_only_old_python_and_numpy():
    allowed = {file: {"numpy", "scipy"} for file in FOREIGN}
    allowed |= {HERE / f"peers/run_{name}.py": {"numpy", *own} for name, own in PEERS.items()}
    for file, packages in allowed.items():
        tree = ast.parse(file.read_text(), feature_version=(3, 9))
        assert imported(tree) <= packages, file


def row(engine, seed, variation, **values):
    common = {"kind": "posterior", "task": "gauss2", "n": 20, "version": "1", "import_s": 1.0}
    measured = {"total_variation": variation, "mean_error": 0.1, "sd_ratio": 1.0, "engine_s": 2.0}
    return {**common, **measured, "engine": engine, "seed": seed, **values}


def test_the_table_holds_medians_over_seeds_and_their_ratio_to_elfi():
    rows = [row("elfi", seed, variation) for seed, variation in enumerate([0.2, 0.8, 0.9])]
    rows += [row("signal", seed, variation) for seed, variation in enumerate([0.4, 0.1, 0.9])]
    rows += [row("signal", 3, 0.4, engine_s=1.0, fresh=True, first_engine_s=7.25)]
    lines = [line.split() for line in report(rows).splitlines() if line.startswith("gauss2")]
    assert lines[0][:6] == ["gauss2", "20", "elfi", "3", "0.80", "1.00"]
    assert lines[1][:6] == ["gauss2", "20", "signal", "4", "0.40", "0.50"]
    assert "7.25" in lines[1]
    assert report([]) == "no results yet"


def test_what_failed_is_named_and_counts_in_no_median():
    failed = row("elfi", 1, 0.0, error="log densities must be finite")
    del failed["total_variation"]
    text = report([row("elfi", 0, 0.5), failed])
    assert "elfi has no posterior on gauss2 at N = 20, seed 1" in text
    line = next(line.split() for line in text.splitlines() if line.startswith("gauss2"))
    assert line[3:5] == ["1", "0.50"]


@pytest.mark.minutes  # the benchmark's own command, no part of the package
def test_a_comparison_ends_in_a_table_and_is_not_made_twice(tmp_path):
    chosen = "--tasks gauss2 --engines discrepancy --budgets 12 --seeds 0 --timed-seeds 1"
    command = [sys.executable, str(HERE / "compare.py"), *chosen.split(), "--out", str(tmp_path)]
    runs = [subprocess.run(command, capture_output=True, text=True, check=True) for _ in range(2)]
    assert runs[0].stdout.startswith("2 processes") and runs[1].stdout.startswith("0 processes")
    table = [[line for line in run.stdout.splitlines() if "gauss2  " in line] for run in runs]
    assert len(table[1]) == 1 and table[0][-1:] == table[1]
    assert "one ask and tell" in runs[1].stdout
