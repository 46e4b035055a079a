"""Rows of a comparison by cell: a task at a number N of simulations; medians over seeds."""

import re
from itertools import product

import numpy as np
import pandas as pd
from tasks import TASKS

START = re.compile(r"a start design of (\d+) simulations")
MEASURES = ("total_variation", "mean_error", "sd_ratio", "coverage", "engine_s")


def admitted(rows: list[dict]) -> tuple[list[dict], list[dict]]:
    """Posteriors of N simulations, and those of engines that need more."""
    made = [row for row in rows if row["kind"] == "posterior"]
    return [r for r in made if needed(r) <= r["n"]], [r for r in made if needed(r) > r["n"]]


def needed(row: dict) -> int:
    design = START.search(row.get("error", ""))
    return int(design[1]) if design else row.get("simulations", 0)


def cells_of(rows: list[dict]) -> list[tuple[str, int]]:
    return sorted({(r["task"], r["n"]) for r in rows}, key=order)


def engines_of(rows: list[dict]) -> list[str]:
    return list(dict.fromkeys(r["engine"] for r in rows))


def order(cell: tuple[str, int]) -> tuple[int, int]:
    return list(TASKS).index(cell[0]), cell[1]


def of(rows: list[dict], engine: str, cell: tuple[str, int]) -> list[dict]:
    return [r for r in rows if r["engine"] == engine and (r["task"], r["n"]) == cell]


def scores(rows: list[dict]) -> pd.DataFrame:
    """Medians over seeds of all measures, a row for each cell and engine."""
    found = []
    for cell, engine in product(cells_of(rows), engines_of(rows)):
        if own := of(rows, engine, cell):
            seeds = len({row["seed"] for row in own})
            found.append([*cell, engine, seeds, *(median(own, name) for name in MEASURES)])
    return pd.DataFrame(found, columns=["task", "n", "engine", "seeds", *MEASURES])


def median(rows: list[dict], name: str) -> float:
    """Of those that have it; NaN where none does. A run without posterior has TV 1."""
    worst = {"total_variation": 1.0}.get(name)
    values = [row.get(name, worst) if "error" in row else row.get(name) for row in rows]
    values = [value for value in values if value is not None]
    return float(np.median(values)) if values else float("nan")


def at(cell: tuple[str, int]) -> str:
    return f"{cell[0]} at N = {cell[1]}"
