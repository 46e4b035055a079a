"""Pours of many liquids in groups of lanes."""

import math
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from .. import runtime
from ..apic.places import GROUPS, Places, room_for
from ..effect import Effect
from ..faults import faulty
from ..liquid import Liquid
from ..runtime import Watch
from .flights import Flights
from .resolution import PER_CELL
from .vessel import RIM, Vessel

# the cells of the bundled cups and coarser ones share a scene
LEAST_CELLS, LEAST_PARTICLES = 12500, 4000


class Pours(NamedTuple):
    """Pours from one cup.

    Attributes:
        liquid: A batch of B.
        tension: Surface tension [N/m], shape [B].
        cosine: Of the contact angle, shape [B].
        rate: At which the cup turns [rad/s], shape [B].
        seeds: Shape [B].
        coefficients: Of the effects in the liquid, shape [effects, B].
    """

    liquid: Liquid
    tension: np.ndarray
    cosine: np.ndarray
    rate: np.ndarray
    seeds: np.ndarray
    coefficients: np.ndarray

    def rows(self, part: np.ndarray) -> "Pours":
        return Pours(
            self.liquid[part],
            self.tension[part],
            self.cosine[part],
            self.rate[part],
            self.seeds[part],
            self.coefficients[:, part],
        )


class PourRotation(NamedTuple):
    """Rotation of cups to `final_angle` [rad], held for `hold` [s], in steps of `dt` [s]."""

    final_angle: float
    hold: float
    dt: float


def march(
    vessel: Vessel,
    pours: Pours,
    turn: PourRotation,
    effects: tuple[Effect, ...] = (),
    watch: Watch | None = None,
) -> list[Flights]:
    """Particles that leave the cup in each pour.

    Warns:
        FailedSimulation: a pour went wrong.
    """
    runtime.start()
    from ..apic.lanes import LANES

    found: list[Any] = [None] * len(pours.seeds)
    for part in _like(pours, GROUPS * LANES):
        together = _together(vessel, pours.rows(part), turn, effects, watch)
        for at, one in zip(part, together, strict=True):
            found[at] = one
    return found


def _like(pours: Pours, size: int) -> Sequence[np.ndarray]:
    """Pours in parts of `size` that take alike: a group iterates until its slowest lane has
    converged, and marches until its longest pour is over."""
    nu = np.asarray(pours.liquid.viscosity) / np.asarray(pours.liquid.density)
    thick = np.floor(np.log10(np.maximum(nu, 1e-4)))
    order = np.lexsort((pours.rate, thick))
    return [order[low : low + size] for low in range(0, len(order), size)]


def _together(vessel, pours: Pours, turn: PourRotation, effects, watch) -> list[Flights]:
    """Like `march`, for at most as many pours as there are lanes."""
    from ..apic.lanes import LANES

    places = Places(len(pours.seeds), GROUPS, LANES)
    points = [vessel.particles(PER_CELL, int(seed)) for seed in pours.seeds]
    n = len(points[0])
    scene = _scene_for(vessel, n, effects)
    scene.enter_cup(vessel, RIM, turn.dt)
    scene.rate, scene.shown = 1.0 / turn.dt, n
    density = np.asarray(pours.liquid.density)
    volume = 0.5 * np.pi * vessel.radius**2 * vessel.fill / n / vessel.cell**3
    rows = (
        np.full(len(density), volume),
        np.asarray(pours.liquid.viscosity) / density,
        density,
        np.full(len(density), vessel.fill - vessel.height),
    )
    positions, counts = places.spread_points(points)
    scene.fill_in(positions, counts, np.stack([places.spread(row) for row in rows]))
    scene.set_coefficients([places.spread(row) for row in pours.coefficients])
    turning = np.rint(turn.final_angle / pours.rate / turn.dt)
    last = np.rint((turn.final_angle / pours.rate + turn.hold) / turn.dt)
    angle = np.full(len(density), turn.final_angle)
    surface = pours.tension / density, pours.cosine
    scene.set_surfaces(np.stack([places.spread(row) for row in surface]))
    turns = pours.rate, angle
    scene.turn(
        np.stack([places.spread(row) for row in turns]),
        np.stack([places.spread(row) for row in (turning, last)]).astype(np.int32),
    )
    groups = places.groups
    runtime.run_chunks(scene, int(last.max()), lambda a, b: scene.march(groups, a, b), watch)
    return _flights(scene, places, pours.seeds, n)


def _flights(scene: Any, places: Places, seeds: np.ndarray, n: int) -> list[Flights]:
    flown, retained, status, flight, departure = (
        places.gather(field.to_numpy())
        for field in (scene.flown, scene.retained, scene.status, scene.flight, scene.departure)
    )
    shares = np.where(faulty(status, seeds), np.nan, retained / n)
    return [
        Flights(flight[k, :many, :3], flight[k, :many, 3:], departure[k, :many], share, n)
        for k, (many, share) in enumerate(zip(flown, shares, strict=True))
    ]


def _scene_for(vessel: Vessel, particles: int, effects: tuple[Effect, ...]) -> Any:
    cells = math.prod(vessel.grid().shape)
    return _scene(room_for(cells, LEAST_CELLS), room_for(particles, LEAST_PARTICLES), effects)


@cache
def _scene(cells: int, particles: int, effects: tuple[Effect, ...]) -> Any:
    """A scene; its fields live as long as the process."""
    runtime.start()
    from .scene import PouringScene

    return PouringScene(GROUPS, cells, particles, effects)
