"""Films that drain down an upright wall: how much is left."""

import numpy as np
from bolfi_liquids.models.apic.gravity import GRAVITY
from case import Case, CaseResult, Curve, Panel, Row
from scenes.wet_box import Body, WetBox, WetLiquid, flow_in_box
from truths.films import jeffreys_thickness, jeffreys_volume

BOX = WetBox((0.32, 0.0, 0.02))
GLYCERIN, OIL = "glycerin", "oil"
LIQUIDS = {
    GLYCERIN: WetLiquid(1.0, 1260.0, 0.063, np.radians(30.0), (GRAVITY, 0.0, 0.0)),
    f"{GLYCERIN} without tension": WetLiquid(1.0, 1260.0, pull=(GRAVITY, 0.0, 0.0)),
    OIL: WetLiquid(0.1, 900.0, 0.032, np.radians(30.0), (GRAVITY, 0.0, 0.0)),
}
FILM = (0.16, 0.008)  # m, length and thickness at the start
WATCHED = 0.1  # m below the upper edge
TIMES = np.array([0.5, 1.0, 2.0])  # s
TOLERANCE = 0.1
THIN = 0.3
"""Where the film is as thin as a third of a cell. Oil's, a quarter of a cell and less, drains away
wholly within a second: see the case `film_flow`."""


def run(seed: int) -> CaseResult:
    """What is left on the watched part of the wall; x is down."""
    length, thickness = FILM
    points = BOX.fill(((0.0, 0.0, 0.0), (length, 0.0, thickness)), seed)
    body = Body(points, length * thickness * BOX.cell)
    bins = round(WATCHED / BOX.cell)

    def look(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        low = position[position[:, 2] < thickness]
        count = np.histogram(low[:, 0], bins, (0.0, WATCHED))[0]
        return count * length * thickness / len(position) / BOX.cell

    liquids = list(LIQUIDS.values())
    time, seen = flow_in_box(BOX, liquids, [body] * len(liquids), TIMES[-1], look)
    rows, curves, notes = [], [], {}
    below = (np.arange(bins) + 0.5) * BOX.cell
    for k, (name, liquid) in enumerate(LIQUIDS.items()):
        like = {"viscosity": liquid.viscosity, "density": liquid.density}
        for end in TIMES:
            truth = 1e3 * float(jeffreys_volume(1.0, WATCHED, end, **like)) / WATCHED
            ours = 1e3 * float(seen[np.abs(time - end) < 0.05, k].mean())
            what = f"mean thickness, {name}, {end:g} s [mm]"
            if name == OIL:
                notes[f"{what}, exact {truth:.2f}"] = round(ours, 2)
            else:
                allowed = TOLERANCE if end < TIMES[-1] else THIN
                rows.append(Row.relative(what, truth, ours, allowed))
        exact = jeffreys_thickness(below, TIMES[-1], **like)
        left = seen[time > TIMES[-1] - 0.1, k].mean(axis=0)
        curves += [
            Curve(name, 1e3 * below, 1e3 * exact, truth=True, series=k),
            Curve("", 1e3 * below, 1e3 * left, series=k),
        ]
    panel = Panel("below the edge [mm]", "thickness [mm]", tuple(curves))
    return CaseResult(tuple(rows), (panel,), notes)


CASE = Case(
    truth="a film that thins as the root of the time, thicker with the root of the viscosity",
    source="Jeffreys 1930, Proc. Camb. Phil. Soc. 26, 204",
    unit="relative",
    run=run,
)
