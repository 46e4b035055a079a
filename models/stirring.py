"""Stirring: a recorded gripper path in, the stick's inclination out."""

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .effect import Effect
from .effect_coefficients import acting_in, changed_rig, changed_signal, liquid_sets, with_adhesion
from .fluid import runtime
from .fluid.faults import faulty
from .fluid.liquid import Liquid
from .fluid.packing import checked_seeds, pack_cylinder
from .fluid.runtime import Watch
from .fluid.settled import Packing, SettledPackings
from .rig import Rig, check_rig
from .stir_setup import StirSetup
from .trajectory import Trajectory, substep_path

SETTLING_TIME = 1.0  # s that a packing relaxes around the held stick
_packings = SettledPackings()


def stir(
    liquid: Liquid,
    gripper: Trajectory,
    setup: StirSetup,
    seeds: ArrayLike,
    effects: Mapping[str, ArrayLike] | None = None,
) -> np.ndarray:
    """Inclination of the stick while the gripper repeats its path in each liquid.

    Args:
        liquid: B liquids; scalars are shared.
        gripper: Path, measured at T times; pivots move linearly between samples.
        setup: Geometry and discretisation.
        seeds: One integer a simulation, shape [B]; it decides the initial packing.
        effects: Coefficients of `EFFECTS` by name, scalars or of shape [B]; they act in the
            alphabetical order of their names, those in the rig and in the liquid before those
            in the sensor.

    Returns:
        Angles [rad] from the downward vertical in the xz and yz planes at the gripper's times,
        shape [B, T, 2]; NaN for a simulation that diverged.

    Raises:
        ValueError: liquid, seeds and coefficients do not agree in length, seeds are no integers,
            the path is too short, an effect is unknown or makes a rig that cannot be.
    Warns:
        FailedSimulation: a simulation went wrong; its angles are NaN.
    """
    return watched_stir(liquid, gripper, setup, seeds, effects)


def watched_stir(
    liquid: Liquid,
    gripper: Trajectory,
    setup: StirSetup,
    seeds: ArrayLike,
    effects: Mapping[str, ArrayLike] | None,
    watch: Watch | None = None,
) -> np.ndarray:
    """What `stir` returns, while `watch` looks at each of its scenes."""
    seeds = checked_seeds(seeds)
    size = len(seeds)
    acting = acting_in("stir", with_adhesion(liquid, effects, size), size)
    liquid = liquid.batch(size)
    path = substep_path(gripper, setup.rate)
    written = Rig(
        stick_mass=np.full(size, setup.stick.mass),
        pivot_friction=np.zeros(size),
        fill=np.full(size, setup.cup.fill),
        path=np.broadcast_to(path, (size, *path.shape)),
    )
    rig = changed_rig(written, acting)
    check_rig(rig, setup.deepest, [a.effect.name for a in acting])
    angles = np.empty((size, len(gripper.time), 2))
    with runtime.LOCK:
        for kinds, rows, coefficients in liquid_sets(acting, size):
            for scene, part in _parts(setup, rig.fill, rows, kinds):
                held = liquid[part], coefficients[:, part]
                directions = _run(scene, setup, held, rig.rows(part), seeds[part], watch=watch)
                angles[part] = inclination(directions, gripper.time, setup.rate)
    return changed_signal(gripper.time, angles, acting)


def inclination(directions: np.ndarray, time: np.ndarray, rate: float) -> np.ndarray:
    """Angles in the xz and yz planes at `time`, from unit vectors at every substep.

    Args:
        directions: From pivot to tip, shape [B, substeps + 1, 3], the first at time[0].
        time: Sample times [s], shape [T].
        rate: Substeps per second.

    Returns:
        Angles [rad], shape [B, T, 2].
    """
    angles = np.arctan2(directions[..., :2], -directions[..., 2:])
    grid = time[0] + np.arange(directions.shape[1]) / rate
    return np.stack(
        [
            np.stack([np.interp(time, grid, trial[:, axis]) for axis in range(2)], axis=1)
            for trial in angles
        ]
    )


def _parts(
    setup: StirSetup, fill: np.ndarray, rows: np.ndarray, effects: tuple[Effect, ...]
) -> Iterator[tuple[Any, np.ndarray]]:
    """Scenes, and which of the simulations `rows` run in each next, at most one a slot.

    Only a simulation's own fill and `effects` decide its scene, so its bits do not depend on
    its company.
    """
    usual = setup.count(fill[rows]) == setup.particles
    for scene_of, todo in ((_scene, rows[usual]), (_roomy_scene, rows[~usual])):
        for low in range(0, len(todo), runtime.SLOTS):
            yield scene_of(setup, effects), todo[low : low + runtime.SLOTS]


@cache
def _scene(setup: StirSetup, effects: tuple[Effect, ...] = ()):
    """The scene compiled for a setup and liquid effects; its fields live as long as the
    process."""
    runtime.start()
    from .stirring_kernel import StirringScene

    return StirringScene(runtime.SLOTS, setup, effects=effects)


@cache
def _roomy_scene(setup: StirSetup, effects: tuple[Effect, ...] = ()):
    """The same with room for more particles than the setup's."""
    runtime.start()
    from .stirring_kernel import StirringScene

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
