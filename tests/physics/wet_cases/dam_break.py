"""A column of water that falls over a dry floor, two of them."""

import numpy as np
from analysis.shapes import column_height, front_position
from case import Case, CaseResult, Curve, Panel, Row
from scenes.wet_box import Body, WetBox, WetLiquid, flow_in_box
from truths.dam_break import (
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
ACROSS = 14  # cells along the base
CELL = BASE / ACROSS
BOX = WetBox((5.5 * BASE, 0.0, 2.5 * BASE), CELL, 0.002)
WATER = WetLiquid(0.001, 1000.0, 0.072, np.radians(60.0))
SECONDS = {1: 0.32, 2: 0.26}
SEEDS = 2
TOLERANCE = 0.1


def tracks(seed: int) -> dict[int, tuple[Track, Track]]:
    """Front and height by aspect, the mean over packings, dimensionless as in the tables."""
    bodies = []
    for aspect in ASPECTS:
        column = ((0.0, 0.0, 0.0), (BASE, 0.0, aspect * BASE))
        points = [BOX.fill(column, seed * SEEDS + k) for k in range(SEEDS)]
        bodies += [Body(one, aspect * BASE**2 * CELL) for one in points]

    def look(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        spacing = 0.5 * CELL
        front = front_position(position, spacing)
        return np.array([front, column_height(position, spacing, BASE / 3.0)]) / BASE

    time, seen = flow_in_box(BOX, [WATER] * len(bodies), bodies, max(SECONDS.values()), look)
    found = {}
    for number, aspect in enumerate(ASPECTS):
        until = time <= SECONDS[aspect]
        mean = seen[until, number * SEEDS : (number + 1) * SEEDS].mean(axis=1)
        front = Track(front_time(time[until], aspect, BASE), mean[:, 0])
        found[aspect] = front, Track(height_time(time[until], BASE), mean[:, 1] / aspect)
    return found


def speed_row(aspect: int, front: Track) -> Row:
    """A front's speed against what is published: two tables of the taller column's differ by a
    fifth, and a speed between theirs has no error."""
    published = [front_speed(FRONT[aspect])]
    if aspect == 2:
        published.append(front_speed(REPEATED_FRONT))
    low, high, ours = min(published), max(published), front_speed(front)
    known = f", published as {low:.2f} to {high:.2f}" if low < high else ""
    error = ours / np.clip(ours, low, high) - 1.0
    quantity = f"speed of the front, column {aspect} high{known}"
    return Row(quantity, float(np.mean(published)), ours, float(error), TOLERANCE)


def run(seed: int) -> CaseResult:
    """Fronts and heights against the tables, after one shift of time."""
    rows, fronts, heights, notes = [], [], [], {}
    for number, (aspect, (front, height)) in enumerate(tracks(seed).items()):
        name = f"column {aspect} high"
        table = FRONT[aspect]
        fit = fit_time_shift(front, table)
        reached = table.value[table.time + LARGEST_SHIFT <= front.time.max()]
        off = fit.rms / reached.mean()
        left = fit_time_shift(height, HEIGHT[aspect])
        rows += [
            speed_row(aspect, front),
            Row(f"front off by, {name}", 0.0, fit.rms, off, TOLERANCE),
            Row.absolute(f"height off by, {name}", 0.0, left.rms, TOLERANCE),
        ]
        notes[f"shift of T, {name}"] = round(fit.shift, 3)
        fronts += [
            Curve("" if number else "Martin & Moyce", *table, truth=True, series=number),
            Curve(name, front.time + fit.shift, front.value, series=number),
        ]
        heights += [
            Curve("", *HEIGHT[aspect], truth=True, series=number),
            Curve(name, height.time + left.shift, height.value, series=number),
        ]
    panels = (
        Panel("T", "front / base", tuple(fronts)),
        Panel("τ", "height / first height", tuple(heights)),
    )
    return CaseResult(tuple(rows), panels, notes)


CASE = Case(
    truth="the front's run and the column's fall, after one shift of time",
    source="Martin & Moyce 1952, Phil. Trans. R. Soc. A 244, 312, tables 2 and 6",
    unit="relative",
    run=run,
)
