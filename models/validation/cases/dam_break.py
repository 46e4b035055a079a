"""A column of water that falls over a dry floor, two of them."""

import numpy as np

from ...fluid.liquid import Liquid
from ..analysis.shapes import column_height, front_position
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..scenes.column import Column, collapse
from ..truths.dam_break import (
    BASE,
    FRONT,
    HEIGHT,
    LARGEST_SHIFT,
    REPEATED_FRONT,
    Track,
    fit_time_shift,
    front_speed,
    front_time,
    height_time,
)

ASPECTS = (1, 2)
ACROSS = 12  # particles along the base
WATER = Liquid(0.001, 0.0, 1000.0)
LENGTH = 5.5  # bases
SECONDS = {1: 0.32, 2: 0.26}
SEEDS = 2
TOLERANCE = 0.1


def tracks(aspect: int, seed: int) -> tuple[Track, Track]:
    """Front and height, the mean over packings, dimensionless as in the tables."""
    column = Column(BASE, aspect * BASE, aspect * ACROSS)
    seeds = [seed * SEEDS + k for k in range(SEEDS)]
    time, position = collapse(column, WATER, LENGTH * BASE, SECONDS[aspect], seeds)
    front = front_position(position, column.spacing).mean(axis=1) / BASE
    left = column_height(position, column.spacing, BASE / 3.0).mean(axis=1) / (aspect * BASE)
    fronts = Track(front_time(time, aspect, BASE), front)
    return fronts, Track(height_time(time, BASE), left)


def nearest_speed(aspect: int, front: Track) -> float:
    """Within what is published: two tables of the taller column differ by a fifth."""
    published = [front_speed(FRONT[aspect])]
    if aspect == 2:
        published.append(front_speed(REPEATED_FRONT))
    return float(np.clip(front_speed(front), min(published), max(published)))


def run(progress: Progress, seed: int) -> CaseResult:
    """Fronts and heights against the tables, after one shift of time."""
    rows, fronts, heights, notes = [], [], [], {}
    for number, aspect in enumerate(ASPECTS):
        name = f"column {aspect} high"
        front, height = tracks(aspect, seed)
        table = FRONT[aspect]
        fit = fit_time_shift(front, table)
        reached = table.value[table.time + LARGEST_SHIFT <= front.time.max()]
        off = fit.rms / reached.mean()
        speed, expected = front_speed(front), nearest_speed(aspect, front)
        rows += [
            Row.relative(f"speed of the front, {name}", expected, speed, TOLERANCE),
            Row(f"front off by, {name}", 0.0, fit.rms, off, TOLERANCE),
        ]
        left = fit_time_shift(height, HEIGHT[aspect])
        rows.append(Row.absolute(f"height off by, {name}", 0.0, left.rms, TOLERANCE))
        notes[f"shift of T, {name}"] = round(fit.shift, 3)
        fronts += [
            Curve("" if number else "Martin & Moyce", *table, truth=True, series=number),
            Curve(name, front.time + fit.shift, front.value, series=number),
        ]
        heights += [
            Curve("", *HEIGHT[aspect], truth=True, series=number),
            Curve(name, height.time + left.shift, height.value, series=number),
        ]
        progress((number + 1) / len(ASPECTS))
    panels = (
        Panel("T", "front / base", tuple(fronts)),
        Panel("τ", "height / first height", tuple(heights)),
    )
    return CaseResult(tuple(rows), panels, notes)


CASE = Case(
    name="dam_break",
    title="Column of water that collapses",
    truth="the front's run and the column's fall, after one shift of time",
    source="Martin & Moyce 1952, Phil. Trans. R. Soc. A 244, 312, tables 2 and 6",
    unit="relative",
    tolerance=TOLERANCE,
    settings={"across": ACROSS, "seeds": SEEDS, "aspects": ASPECTS, "length": LENGTH},
    run=run,
)
