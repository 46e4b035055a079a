"""A command that examines every data set in processes, and goes on where it was stopped."""

import argparse
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from data_sets import DataSet, files
from kept import keep, results
from machine import machine

Examine = Callable[[DataSet], dict]


def run(
    examine: Examine, folder: Path, path: Path, workers: int, first: int | None
) -> Iterator[dict]:
    """Examine the data sets that have no result yet. Yield each result once it is kept.

    Args:
        examine: A function of a module, for other processes.
        folder: Of the data sets.
        path: Of the results.
        workers: Processes.
        first: How many sets of each subject; all by default.
    """
    done = {(r["subject"], r["number"]) for r in results(path)}
    sets = [one for file in files(folder) for one in file[:first]]
    left = [one for one in sets if (one.subject, one.number) not in done]
    left.sort(key=lambda one: one.number)
    made = machine()
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for result in pool.map(examine, left, chunksize=4):
            result["made"] = made
            keep(path, result)
            yield result


def main(examine: Examine, description: str | None, out: str) -> None:
    """The command line; results are kept in the file `out` by default."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("sets", type=Path, help="folder that data_sets.py wrote")
    parser.add_argument("--out", type=Path, default=Path(out))
    parser.add_argument("--first", type=int, help="how many sets of each subject; all by default")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    found = run(examine, asked.sets, asked.out, asked.workers, asked.first)
    for count, _ in enumerate(found, 1):
        print(f"\r{count}", end="", file=sys.stderr, flush=True)
