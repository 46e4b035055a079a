"""Stirs of the former particle fluid."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from .effect import Effect
from .effect_coefficients import Acting, liquid_sets
from .fluid import runtime
from .fluid.faults import faulty
from .fluid.liquid import Liquid
from .fluid.packing import pack_cylinder
from .fluid.runtime import Watch
from .fluid.settled import Packing, SettledPackings
from .rig import Rig
from .stir_setup import StirSetup

SETTLING_TIME = 1.0  # s that a packing relaxes around the held stick
_packings = SettledPackings()


def stir_particles(
    setup: StirSetup,
    liquid: Liquid,
    rig: Rig,
    seeds: np.ndarray,
    acting: tuple[Acting, ...],
    watch: Watch | None,
) -> np.ndarray:
    """Directions of the sticks at the ends of all substeps, shape [B, substeps + 1, 3]."""
    size = len(seeds)
    found = np.empty((size, rig.path.shape[1], 3))
    for kinds, rows, coefficients in liquid_sets(acting, size):
        for scene, part in _parts(setup, rig.fill, rows, kinds):
            held = liquid[part], coefficients[:, part]
            found[part] = _run(scene, setup, held, rig.rows(part), seeds[part], watch=watch)
    return found


def _parts(
    setup: StirSetup, fill: np.ndarray, rows: np.ndarray, effects: tuple[Effect, ...]
) -> Iterator[tuple[Any, np.ndarray]]:
    """Scenes, and which of the simulations `rows` run in each next, at most one a slot.

    Only a simulation's own fill and `effects` decide its scene, so its bits do not depend on
    its company.
    """
    upright = replace(setup, tilt=(0.0, 0.0))  # this fluid's sticks start so
    usual = setup.count(fill[rows]) == setup.count(setup.cup.fill)
    for scene_of, todo in ((_scene, rows[usual]), (_roomy_scene, rows[~usual])):
        for low in range(0, len(todo), runtime.SLOTS):
            yield scene_of(upright, effects), todo[low : low + runtime.SLOTS]


@cache
def _scene(setup: StirSetup, effects: tuple[Effect, ...] = ()):
    """The scene compiled for a setup and liquid effects; its fields live as long as the
    process."""
    runtime.start()
    from .particle_stirring_kernel import StirringScene

    return StirringScene(runtime.SLOTS, setup, effects=effects)


@cache
def _roomy_scene(setup: StirSetup, effects: tuple[Effect, ...] = ()):
    """The same with room for more particles than the setup's."""
    runtime.start()
    from .particle_stirring_kernel import StirringScene

    return StirringScene(runtime.SLOTS, setup, int(setup.count(setup.deepest)), effects)


def _run(scene, setup, held, rig, seeds, *, watch: Watch | None = None) -> np.ndarray:
    """Directions of the sticks, shape [B, substeps + 1, 3]; NaN where a trial diverged.

    `held` are the liquid and the coefficients [effects, B] of the scene's effects.
    """
    size = len(seeds)
    pivots = rig.path[:, 0]
    counts = setup.count(rig.fill)

    def settle(places: list[int]) -> list[Packing]:
        points = [_pack(setup, int(counts[k]), int(seeds[k]), pivots[k]) for k in places]
        scene.place_stick(pivots[places])
        scene.hold_stick(True)
        return scene.settled(points, SETTLING_TIME)

    # by scene too: with effects compiled in, the last bit of a rest may differ
    fixed = setup, tuple(effect.name for effect in scene.effects)
    keys = [(fixed, counts[k], seeds[k], tuple(pivots[k])) for k in range(size)]
    packings = _packings.of(keys, settle)
    scene.place([p.position for p in packings], [p.multiplier for p in packings])
    scene.place_stick(pivots)
    scene.hold_stick(False)
    scene.pour_in(*held)
    scene.fit_stick(rig.stick_mass, rig.pivot_friction)

    path = rig.path[:, 1:].astype(np.float32, order="C")
    steps = path.shape[1]
    directions = np.empty((size, steps, 3), np.float32)
    runtime.run_chunks(
        scene,
        steps,
        lambda start, stop: scene.stir(size, start, stop, path, directions, 1.0),
        watch,
    )
    directions[faulty(scene.fault.to_numpy()[:size], seeds)] = np.nan
    down = np.broadcast_to(np.array([0.0, 0.0, -1.0], np.float32), (size, 1, 3))
    return np.concatenate([down, directions], axis=1).astype(np.float64)


def _pack(setup: StirSetup, particles: int, seed: int, pivot: np.ndarray) -> np.ndarray:
    """Where the particles start [m], shape [particles, 3], around a stick hung from `pivot`."""
    clearance = setup.stick.radius + 0.4 * setup.spacing
    tip = pivot[2] - setup.stick.length - 0.4 * setup.spacing

    def in_stick(points: np.ndarray) -> np.ndarray:
        return (np.hypot(*(points - pivot)[:, :2].T) < clearance) & (points[:, 2] > tip)

    return pack_cylinder(setup.cup.radius, setup.spacing, particles, seed, in_stick)
