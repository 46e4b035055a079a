"""Pours against the tables of another solver, with nothing fitted to the liquid."""

import csv
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.stats import spearmanr

from bolfi_liquids import models

from .line import Line
from .liquids import COHESION, LISTED

# table, cups, RMS without gel, RMS of gel; fractions of the liquid
TABLES = (
    ("pours_low_lip.csv", "cups_low_lip.toml", 0.07, 0.12),
    ("pours.csv", "cups.toml", 0.10, None),
)
RANK, REGRET, CPU_SECONDS = 0.85, 0.03, 0.8
FINER = 2  # steps that ours takes for one of the table's
SEEDS = 2  # that an action is tried with


class Table(NamedTuple):
    """Pours [n]: liquid, angular velocity [deg/s], distance [cm] and fraction spilled."""

    liquid: np.ndarray
    rate: np.ndarray
    distance: np.ndarray
    spilled: np.ndarray

    def of(self, liquid: str) -> "Table":
        """The rows of one liquid."""
        return Table(*(column[self.liquid == liquid] for column in self))


def read_table(path: Path) -> Table:
    """A table with a header, lines of # left out."""
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    numbers = ("angular_velocity_deg_s", "distance_cm", "spilled_fraction")
    columns = (np.array([float(row[name]) for row in rows]) for name in numbers)
    return Table(np.array([row["liquid"] for row in rows]), *columns)


def pours(folder: Path) -> Iterator[Line]:
    """Of the tables in a folder."""
    for name, cups, most, most_gel in TABLES:
        if (folder / name).exists():
            bars = most, most_gel
            yield from _table(name, read_table(folder / name), _cups(folder / cups), bars)


def _cups(path: Path) -> models.Cups:
    return models.Cups.from_toml(path)


def _table(name, table, cups, bars) -> Iterator[Line]:
    pour(table, cups, seed=0)  # compiles, and lets the packings settle
    start = time.process_time()
    ours = pour(table, cups, seed=0)
    yield Line(
        f"{name}, a pour [CPU s]",
        (time.process_time() - start) / len(ours),
        CPU_SECONDS,
    )
    gel = table.liquid == "gel"
    for group, rows, bar in (("without gel", ~gel, bars[0]), ("gel", gel, bars[1])):
        if rows.any():
            apart = np.sqrt(np.mean((ours - table.spilled)[rows] ** 2))
            yield Line(f"{name}, {group}: RMS of the spilled fraction", float(apart), bar)
    rank = spearmanr(ours[~gel], table.spilled[~gel]).statistic
    yield Line(f"{name}, without gel: rank correlation", float(rank), RANK, least=True)
    for liquid in dict.fromkeys(table.liquid):
        mean, worst = regret(table.of(liquid), lambda tried: _mean(tried, cups))
        what = f"{name}, {liquid}: spilled beyond the best action"
        yield Line(f"{what}, worst of equals", worst, REGRET)
        yield Line(f"{what}, mean of equals", mean)


def pour(table: Table, cups: models.Cups, seed: int) -> np.ndarray:
    """Fractions that ours spills of the table's pours, each with a seed of its own from `seed`."""
    viscosity, density = np.array([LISTED[name] for name in table.liquid]).T
    action = models.PourAction(np.radians(table.rate), table.distance / 100.0)
    seeds = seed + np.arange(len(table.liquid))
    return models.pour(models.Liquid(viscosity, COHESION, density), action, cups, seeds).spilled


def _mean(table: Table, cups: models.Cups) -> np.ndarray:
    count = len(table.liquid)
    return np.mean([pour(table, cups, seed=n * count) for n in range(SEEDS)], axis=0)


def regret(table: Table, simulate: Callable[[Table], np.ndarray]) -> tuple[float, float]:
    """What the action that we like best spills by the table, beyond the table's best.

    The table of one liquid is interpolated between its actions; ours tries these and those
    between them.

    Args:
        table: Pours of one liquid.
        simulate: Ours, from a table whose spilled fractions are not looked at.

    Returns:
        Mean over the actions that ours likes equally, as several spill nothing, and their worst;
        NaN where a simulation failed.
    """
    reference = LinearNDInterpolator(
        np.column_stack([table.rate, table.distance]), table.spilled, rescale=True
    )
    mesh = np.meshgrid(_finer(table.rate), _finer(table.distance), indexing="ij")
    rate, distance = (axis.ravel() for axis in mesh)
    theirs = reference(rate, distance)
    known = np.isfinite(theirs)  # the table's actions need not fill their rectangle
    liquid = np.repeat(table.liquid[:1], known.sum())
    ours = simulate(Table(liquid, rate[known], distance[known], theirs[known]))
    if not np.isfinite(ours).all():
        return float("nan"), float("nan")
    beyond = theirs[known][ours == ours.min()] - table.spilled.min()
    return float(beyond.mean()), float(beyond.max())


def _finer(values: np.ndarray) -> np.ndarray:
    levels = np.unique(values)
    at = np.linspace(0, len(levels) - 1, FINER * (len(levels) - 1) + 1)
    return np.interp(at, np.arange(len(levels)), levels)
