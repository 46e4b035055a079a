"""Gels and shear-thinning liquids that a force turns in a cup, against their profiles."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from bolfi_liquids.models.effects.shear_thinning import ONSET_TIME
from bolfi_liquids.models.effects.yield_stress import REGULARISATION_TIME
from case import Case, CaseResult, Curve, Panel, Row
from scenes.still_cup import DENSITY, Flow, StillCup, flow_in_cup, swirl_of
from truths.generalised_flows import generalised_swirl

CUP = StillCup(slippery_floor=True)
SECONDS = 1.5
LATE = 0.75  # s from which the profile is averaged
RINGS = np.linspace(0.0, CUP.radius, 9)
TOLERANCE = 0.1  # of the largest speed
NARROW_TOLERANCE = 0.3  # where fewer cells are sheared than MIN_SHEARED_CELLS
MIN_SHEARED_CELLS = 2.9
"""At rest these gels are up to 36 times as thick as at the wall. Where they were a thousand times,
they would flow at metres per second."""


class Turned(NamedTuple):
    """Viscosity at rest or of what flows [Pa s], coefficient, and stress at the wall [Pa]."""

    viscosity: float
    coefficient: float
    stress: float

    @property
    def drive(self) -> float:
        """Density times the acceleration around the axis over the distance from it [Pa/m²]."""
        return 4.0 * self.stress / CUP.radius**2


GELS = (Turned(2.0, 10.0, 25.0), Turned(5.0, 20.0, 60.0), Turned(0.5, 10.0, 18.0))
THINNING = (Turned(3.0, 0.3, 5.0), Turned(10.0, 0.5, 8.0), Turned(2.0, 0.7, 1.5))


def gel(rate: float, turned: Turned) -> float:
    """Viscosity [Pa s] of a liquid with a yield stress, at a shear rate [1/s]."""
    creep = -np.expm1(-REGULARISATION_TIME * rate) / rate
    return turned.viscosity + turned.coefficient * creep


def thinning(rate: float, turned: Turned) -> float:
    """Viscosity [Pa s] of a liquid that thins, at a shear rate [1/s]."""
    return turned.viscosity * (1.0 + (ONSET_TIME * rate) ** 2) ** (-0.5 * turned.coefficient)


GROUPS = (("yield_stress", GELS, gel), ("shear_thinning", THINNING, thinning))
Law = Callable[[float, Turned], float]


def exact(r: np.ndarray, law: Law, turned: Turned) -> np.ndarray:
    """Speed around the axis [m/s] at distances from it [m]."""
    return generalised_swirl(
        r, radius=CUP.radius, drive=turned.drive, viscosity=lambda rate: law(rate, turned)
    )


def tolerance(effect: str, turned: Turned) -> float:
    """Of a gel, by how much of it flows: what is within the plug does not."""
    plug = CUP.radius * np.sqrt(turned.coefficient / turned.stress)
    narrow = effect == "yield_stress" and CUP.radius - plug < MIN_SHEARED_CELLS * CUP.cell
    return NARROW_TOLERANCE if narrow else TOLERANCE


def turned_rings(effect: str, liquids: tuple[Turned, ...], seed: int) -> np.ndarray:
    """Mean speed around the axis in each ring [m/s], shape [B, rings], late in each flow."""

    def look(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        r, speed = swirl_of(position, velocity)
        count = np.histogram(r, RINGS)[0]
        return np.histogram(r, RINGS, weights=speed)[0] / np.maximum(count, 1)

    viscosity, coefficient = (
        np.array([getattr(one, n) for one in liquids]) for n in Turned._fields[:2]
    )
    strength = np.array([one.drive for one in liquids]) / DENSITY
    flow = Flow(swirl=lambda r: r, strength=strength, effects={effect: coefficient})
    time, seen = flow_in_cup(CUP, viscosity, flow, SECONDS, look, seed)
    return seen[time > LATE].mean(axis=0)


def ring_means(law: Law, turned: Turned) -> np.ndarray:
    """Exact mean speed in each ring, over its area [m/s]."""
    fine = np.linspace(0.0, CUP.radius, 40 * (len(RINGS) - 1), endpoint=False)
    fine += 0.5 * fine[1]
    speed = exact(fine, law, turned)
    at = np.histogram(fine, RINGS, weights=fine * speed)[0]
    return at / np.histogram(fine, RINGS, weights=fine)[0]


def run(seed: int) -> CaseResult:
    """Profiles from rest on."""
    rows, panels = [], []
    middle = 0.5 * (RINGS[1:] + RINGS[:-1])
    fine = np.linspace(0.0, CUP.radius, 200)
    for effect, liquids, law in GROUPS:
        curves = []
        for k, (turned, ours) in enumerate(
            zip(liquids, turned_rings(effect, liquids, seed), strict=True)
        ):
            expected, most = ring_means(law, turned), tolerance(effect, turned)
            name = f"{effect} {turned.coefficient:g}, {turned.viscosity:g} Pa s"
            worst = float(np.abs(ours - expected).max() / expected.max())
            rows += [
                Row.relative(f"largest speed, {name} [m/s]", expected.max(), ours.max(), most),
                Row(f"largest error of the profile, {name}", 0.0, worst, worst, most),
            ]
            curves += [
                Curve(name, 1e3 * fine, exact(fine, law, turned), truth=True, series=k),
                Curve("", 1e3 * middle, ours, series=k),
            ]
        panels.append(Panel("distance from the axis [mm]", "speed around it [m/s]", tuple(curves)))
    return CaseResult(tuple(rows), tuple(panels))


CASE = Case(
    truth="the profile that carries a stress as the distance from the axis squared",
    source="momentum; the laws of Papanastasiou 1987 (J. Rheol. 31, 385) and Carreau 1972",
    unit="relative",
    run=run,
)
