"""Thin films on a floor: their edges draw back where the liquid does not wet it."""

from typing import NamedTuple

import numpy as np
from case import Case, CaseResult, Curve, Panel, Row
from scenes.wet_box import Body, WetBox, WetLiquid, flow_in_box
from truths.films import dewetting_speed

BOX = WetBox((0.16, 0.0, 0.024))
FILM = (0.02, 0.14)  # m, from edge to edge
DENSITY, TENSION = 1260.0, 0.063  # glycerin's
SEEDS = 4  # that are averaged: an edge is a particle or two
SECONDS = 0.5
WATCHED = np.array([0.5, 1.5])  # cells that the truth draws back while the speed is taken
TOLERANCE = 1.2
"""Of the logarithm of the speed over the truth, which is known to a factor of three."""
STAYS = 0.25  # cells


class Film(NamedTuple):
    """Contact angle [deg], viscosity [Pa s], thickness [m]."""

    angle: float
    viscosity: float
    thickness: float

    def __str__(self) -> str:
        thick = f"{1e3 * self.thickness:g} mm"
        return f"{self.angle:g} deg, {self.viscosity:g} Pa s, {thick} thick"


DRAW_BACK = [Film(angle, mu, 1e-3) for angle in (110.0, 150.0) for mu in (1.0, 0.3)]
DRAW_BACK += [Film(110.0, 1.0, thickness) for thickness in (0.5e-3, 1.5e-3)]
STAY = [Film(60.0, mu, 1e-3) for mu in (1.0, 0.3)]


def run(seed: int) -> CaseResult:
    """How far edges have moved, mean of both and of several seeds."""
    films = [film for film in DRAW_BACK + STAY for _ in range(SEEDS)]
    liquids = [
        WetLiquid(film.viscosity, DENSITY, TENSION, np.radians(film.angle)) for film in films
    ]
    bodies = [_body(film, SEEDS * seed + n % SEEDS) for n, film in enumerate(films)]
    time, width = flow_in_box(BOX, liquids, bodies, SECONDS, _width)
    moved = 0.5 * (width[0] - width).reshape(len(time), -1, SEEDS).mean(axis=2)
    rows = []
    for film, drawn in zip(DRAW_BACK, moved.T, strict=False):
        like = {"tension": TENSION, "viscosity": film.viscosity}
        truth = float(dewetting_speed(np.radians(film.angle), **like))
        since, until = WATCHED * BOX.cell / truth
        ours = float(np.diff(np.interp([since, until], time, drawn))[0] / (until - since))
        error = float(np.log(ours / truth)) if ours > 0.0 else -np.inf
        rows.append(Row(f"speed of the edge, {film} [m/s]", truth, ours, error, TOLERANCE))
    for film, drawn in zip(STAY, moved.T[len(DRAW_BACK) :], strict=True):
        ours = float(np.abs(drawn).max() / BOX.cell)
        rows.append(Row.absolute(f"the edge moves by, {film} [cells]", 0.0, ours, STAYS))
    curves = tuple(
        Curve(str(film), time, 1e3 * drawn, series=k)
        for k, (film, drawn) in enumerate(zip(DRAW_BACK + STAY, moved.T, strict=True))
    )
    return CaseResult(tuple(rows), (Panel("time [s]", "drawn back [mm]", curves),))


def _body(film: Film, seed: int) -> Body:
    low, high = FILM
    points = BOX.fill(((low, 0.0, 0.0), (high, 0.0, film.thickness)), seed)
    return Body(points, (high - low) * film.thickness * BOX.cell)


def _width(position: np.ndarray, velocity: np.ndarray) -> float:
    return float(np.ptp(position[:, 0]))


CASE = Case(
    truth="a film that wets too little draws back at σ a³ / (9 μ ln), whatever its thickness, and "
    "one that wets stays",
    source="Voinov 1976; Redon, Brochard-Wyart & Rondelez 1991, Phys. Rev. Lett. 66, 715",
    unit="log of the ratio",
    run=run,
)
