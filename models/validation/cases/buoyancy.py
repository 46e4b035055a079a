"""Lift of a liquid at rest on a stick that is held tilted in it."""

import numpy as np

from ...fluid import runtime
from ...fluid.fluid import DAMPING
from ...fluid.liquid import Liquid
from ...fluid.numerics import ParticleNumerics
from ...particle_stirring import _pack, _scene
from ...stir_setup import Cup, Stick, StirSetup
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..truths.pendulum import Rod, archimedes_torque
from ._stirring import STICKS

STICK = Stick(radius=0.0045, length=0.22, mass=1200.0 * np.pi * 0.0045**2 * 0.22)
CUP = Cup(radius=0.04, height=0.075, fill=0.05)
SUBMERGED = 0.04  # m, upright
DENSITY, VISCOSITY = 1260.0, 0.05
TILTS = (8.0, 15.0, 25.0)  # deg
HEAVY = 1e4  # times the stick's mass: it stays where it is, and its swing sums up the pushes
REST, SPAN = 1.0, 3.0  # s, before and while the pushes are summed
PACKINGS = 8
TOLERANCE = 0.05


def torque(numerics: ParticleNumerics, tilt: float, seed: int) -> tuple[np.ndarray, float]:
    """Of the liquid on each stick about its pivot, towards the surface, and of Archimedes [N m]."""
    setup = StirSetup(CUP, STICK, SUBMERGED, numerics=numerics)
    # the wet part near the axis
    reach = STICK.length - SUBMERGED / 2
    height = STICK.length - SUBMERGED + CUP.fill
    pivots = np.tile([-reach * np.sin(tilt), 0.0, height], (PACKINGS, 1))
    with runtime.LOCK:
        scene = _scene(setup, ())
        seeds = seed * PACKINGS + np.arange(PACKINGS)
        upright = pivots * [0.0, 0.0, 1.0]
        scene.place([_pack(setup, setup.particles, int(s), upright[0]) for s in seeds])
        scene.fit_stick(np.full(PACKINGS, HEAVY * STICK.mass), np.zeros(PACKINGS))
        scene.place_stick(pivots)
        direction = np.zeros((scene.slots, 3), np.float32)
        direction[:, 0], direction[:, 2] = np.sin(tilt), -np.cos(tilt)
        scene.direction.from_numpy(direction)
        scene.pour_in(Liquid(VISCOSITY, 0.0, DENSITY).batch(PACKINGS))
        for damping in (DAMPING, 1.0):
            scene.flow_on(PACKINGS, round(REST * scene.rate), damping)
        scene.swing.fill(0.0)
        steps = round(SPAN * scene.rate)
        scene.flow_on(PACKINGS, steps, 1.0)
        swing = scene.swing.to_numpy()[:PACKINGS].astype(float)
    turn = swing @ [np.cos(tilt), 0.0, np.sin(tilt)]
    ours = turn * HEAVY * STICK.inertia * scene.rate / steps
    weightless = Rod(STICK.length, STICK.radius, 1e-12)
    # what the tilted stick displaces more than the upright one is spread over the cup
    return ours, -float(archimedes_torque(tilt, weightless, height - CUP.fill, DENSITY))


def run(progress: Progress, seed: int) -> CaseResult:
    """The mean over packings at each tilt, for either stick."""
    rows, curves = [], []
    for number, (stick, numerics) in enumerate(STICKS.items()):
        tilts, means = [], []
        for degrees in TILTS:
            ours, expected = torque(numerics, np.radians(degrees), seed)
            name = f"torque at {degrees:g} deg{stick} [N m]"
            rows.append(Row.relative(name, expected, ours.mean(), TOLERANCE))
            tilts.append(np.full(PACKINGS, degrees))
            means.append(1e3 * ours)
        curves.append(Curve(f"packings{stick}", np.ravel(tilts), np.ravel(means), series=number))
        progress((number + 1) / len(STICKS))
    fine = np.linspace(0.0, 1.2 * TILTS[-1], 30)
    surface = STICK.length - SUBMERGED
    weightless = Rod(STICK.length, STICK.radius, 1e-12)
    exact = -1e3 * archimedes_torque(np.radians(fine), weightless, surface, DENSITY)
    curves.append(Curve("Archimedes", fine, exact, truth=True))
    panel = Panel("tilt [deg]", "torque of the lift [mN m]", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    name="buoyancy",
    title="Lift on a tilted stick",
    truth="the weight of what the stick displaces, at the middle of its wet part",
    source="Archimedes, On Floating Bodies",
    unit="relative",
    tolerance=TOLERANCE,
    settings={"tilts": TILTS, "packings": PACKINGS, "seconds": (REST, SPAN)},
    run=run,
)
