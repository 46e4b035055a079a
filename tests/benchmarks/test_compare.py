"""The comparison's own machinery: what resumes, what is stale, what the peers can read."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from engines import ENGINES
from report import admitted, holm, report, scores, summary, task_table
from tasks import TASKS

HERE = Path(__file__).parent
FOREIGN = [*(HERE / "tasks").glob("*.py"), HERE / "peers/job.py"]
PEERS = {
    "elfi": {"elfi"},
    "sbi": {"sbi", "torch", "tabpfn"},
    "vbmc": {"pyvbmc"},
    "surmise": {"surmise", "scipy"},
}


def imported(tree):
    """Packages that a module imports, those beside it left out."""
    names = {"collections", "contextlib", "dataclasses", "functools", "importlib"}
    names |= {"io", "json", "os"}
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
    scored = {"total_variation": variation, "mean_error": 0.1, "sd_ratio": 1.0, "coverage": 0.9}
    measured = {"engine_s": 2.0, "simulations": 20}
    return {**common, **scored, **measured, "engine": engine, "seed": seed, **values}


def rows_of(engine, variations):
    return [row(engine, seed, variation) for seed, variation in enumerate(variations)]


def lines(text, *start):
    """Rows of the report's tables that begin with these cells, the cells after them."""
    found = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines()]
    return [one[len(start) :] for one in found if tuple(one[: len(start)]) == start]


def table(rows, engine):
    """The row of the CSV file of `engine`, without what never varies here."""
    (found,) = scores(rows)[lambda of: of["engine"] == engine].to_dict("records")
    return found


def test_the_table_holds_medians_over_seeds_with_smaller_ones_in_bold():
    rows = rows_of("signal", [0.4, 0.1, 0.9]) + rows_of("elfi", [0.2, 0.8, 0.3])
    rows += rows_of("npe", [0.395] * 3)
    assert lines(report(rows), "gauss2 20") == [["0.40", "**0.30**", "0.40"]]
    assert table(rows, "elfi")["total_variation"] == 0.3
    assert (table(rows, "signal")["seeds"], table(rows, "signal")["engine_s"]) == (3, 2.0)
    assert report([]) == "no results yet"


def test_a_difference_is_marked_only_where_enough_seeds_agree_on_it():
    few, many = np.arange(5) / 100.0, np.arange(20) / 100.0
    for variations, sure in ((few, []), (many, ["1", "0"])):
        rows = rows_of("signal", variations) + rows_of("npe", variations + 0.3)
        rows += rows_of("nle", variations[::-1] - 0.001)
        text = report(rows)
        assert lines(text, "npe") == [["1", "1", "0", "0", *sure]]
        assert lines(text, "nle") == [["1", "0", "1", "0", *("0" for _ in sure)]]
        assert lines(text, "gauss2 20")[0][1].endswith("*") == bool(sure)


def test_the_summary_counts_what_the_rows_show():
    rows = [
        row(engine, 0, variation, n=n, coverage=coverage)
        for n, of in {
            20: {"signal": (0.5, 0.7), "npe": (0.4, 0.9), "vbmc": (0.1, 0.9)},
            40: {"signal": (0.3, 0.9), "npe": (0.4, 0.9), "vbmc": (0.5, 0.9)},
            60: {"signal": (0.29, 0.9), "npe": (0.285, 0.9)},
        }.items()
        for engine, (variation, coverage) in of.items()
    ]
    best, told, stalled, narrow, high = summary(rows)
    assert "2 of 3 cells" in best and "gauss2 at N = 20 to `npe` (0.50; 0.40)" in best
    assert "1 of 2 cells" in told and "gauss2 at N = 20 to `vbmc` (0.50; 0.10)" in told
    assert "gauss2 (0.29)" in stalled and "gauss2 at N = 20 (0.70)." in narrow and "none" in high


def test_holm_s_correction():
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])


def test_what_failed_is_named_and_is_as_far_off_as_can_be():
    failed = row("elfi", 1, 0.0, error="log densities must be finite")
    for name in ("total_variation", "mean_error"):
        del failed[name]
    text = report([*rows_of("signal", [0.6, 0.6]), row("elfi", 0, 0.5), failed])
    assert "has no posterior on gauss2 at N = 20, seed 1: log densities" in text
    assert lines(text, "gauss2 20") == [["0.60", "0.75"]]


def test_a_run_of_more_simulations_than_asked_is_not_compared():
    rows = [row("signal", 0, 0.5), row("vbmc", 0, 0.1, simulations=25)]
    rows += [row("elfi", 0, 0.2, simulations=0, error="a start design of 33 simulations")]
    text = report(rows)
    assert lines(text, "gauss2 20") == [["0.50"]]
    assert len(admitted(rows)[1]) == 2
    for engine, needed in {"vbmc": 25, "elfi": 33}.items():
        assert f"`{engine}` is left out on gauss2 at N = 20: it needs {needed} simulations" in text


def test_every_task_is_told():
    text = "\n".join(task_table([(task, 20) for task in TASKS]))
    assert lines(text, "slcp")[0][1:] == ["5", "5", "simulator", "sbibm T.3"]
    assert lines(text, "pendobs3")[0][1:4] == ["3", "180", "data, known covariance"]
    assert sum(len(lines(text, task)) for task in TASKS) == len(TASKS)


def test_engines_take_tasks_that_they_can_do():
    taken = {e: {t for t in TASKS if ENGINES[e].takes(TASKS[t])} for e in ENGINES}
    assert taken["signal"] == taken["elfi"] == set(TASKS)
    assert taken["vbmc"] - taken["surmise"] == {"ball_drop"}  # three numbers
    assert "gauss2" not in taken["vbmc"]


@pytest.mark.minutes  # the benchmark's own command, no part of the package
def test_a_comparison_ends_in_a_table_and_is_not_made_twice(tmp_path):
    chosen = "--tasks gauss2 --engines discrepancy --budgets 12 --seeds 0 --timed-seeds 1"
    command = [sys.executable, str(HERE / "compare.py"), *chosen.split(), "--out", str(tmp_path)]
    runs = [subprocess.run(command, capture_output=True, text=True, check=True) for _ in range(2)]
    assert runs[0].stdout.startswith("2 processes") and runs[1].stdout.startswith("0 processes")
    found = [lines(run.stdout, "gauss2 12") for run in runs]
    assert len(found[1]) == 1 and found[0] == found[1]
    assert "one ask and tell" in runs[1].stdout
