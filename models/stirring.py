"""Stirring: a recorded gripper path in, the stick's inclination out."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from . import runtime
from .effect_coefficients import acting_in, changed_rig, changed_signal, liquid_sets, with_adhesion
from .liquid import Liquid
from .number_checks import checked_seeds
from .rig import Rig, check_rig
from .runtime import Watch
from .stir_setup import StirSetup, hanging, start_tilt
from .stirs.march import Stirs, march
from .trajectory import PivotPath, step_path


def stir(
    liquid: Liquid,
    gripper: PivotPath,
    setup: StirSetup,
    seeds: ArrayLike,
    effects: Mapping[str, ArrayLike] | None = None,
    watch: Watch | None = None,
) -> np.ndarray:
    """Inclination of the stick while the gripper repeats its path in each liquid.

    Args:
        liquid: B liquids; scalars are shared.
        gripper: Path, measured at T times.
        setup: Geometry and discretisation.
        seeds: One integer a simulation, shape [B]; it decides where the particles start.
        effects: Coefficients of `EFFECTS` by name, scalars or of shape [B]; they act in the
            alphabetical order of their names, those in the rig and in the liquid before those
            in the sensor.
        watch: Observer of each scene.

    Returns:
        Angles [rad] from the downward vertical in the xz and yz planes at the gripper's times,
        shape [B, T, 2]; NaN for a simulation that diverged.

    Raises:
        ValueError: liquid, seeds and coefficients do not agree in length, seeds are no integers,
            the path is too short, an effect is unknown or makes a rig that cannot be.
    Warns:
        FailedSimulation: a simulation went wrong; its angles are NaN.
    """
    seeds = checked_seeds(seeds)
    size = len(seeds)
    acting = acting_in("stir", with_adhesion(liquid, effects, size), size)
    liquid = liquid.batch(size)
    step = setup.step(gripper)
    path = step_path(gripper, step)
    written = Rig(
        stick_mass=np.full(size, setup.stick.mass),
        pivot_friction=np.zeros(size),
        fill=np.full(size, setup.cup.fill),
        path=np.broadcast_to(path, (size, *path.shape)),
    )
    rig = changed_rig(written, acting)
    check_rig(rig, setup.deepest, [a.effect.name for a in acting])
    directions = np.empty((size, path.shape[0], 3))
    with runtime.LOCK:
        # what tilted cameras add is no lean of the stick
        upright = changed_signal(gripper.time, np.zeros((size, len(gripper.time), 2)), acting)
        start = hanging(start_tilt(setup, rig, liquid.density, upright[:, 0]))
        for kinds, rows, coefficients in liquid_sets(acting, size):
            stirs = Stirs(liquid, rig, seeds, start, coefficients).rows(rows)
            directions[rows] = march(setup, stirs, step, kinds, watch)
    return changed_signal(gripper.time, inclination(directions, gripper.time, step), acting)


def inclination(directions: np.ndarray, time: np.ndarray, step: float) -> np.ndarray:
    """Angles in the xz and yz planes at `time`, from unit vectors at every step.

    Args:
        directions: From pivot to tip, shape [B, steps + 1, 3], the first at time[0].
        time: Sample times [s], shape [T].
        step: Of the simulation [s].

    Returns:
        Angles [rad], shape [B, T, 2].
    """
    angles = np.arctan2(directions[..., :2], -directions[..., 2:])
    grid = time[0] + np.arange(directions.shape[1]) * step
    return np.stack(
        [
            np.stack([np.interp(time, grid, trial[:, axis]) for axis in range(2)], axis=1)
            for trial in angles
        ]
    )
