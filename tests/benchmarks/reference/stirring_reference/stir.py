"""A stir from its beginning to its end."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import immersed_boundary as immersed
from .box import Box
from .flow import Flow, advanced, standing_wall, still
from .gripper_paths import GripperPath, Motion
from .immersed_boundary import Surface
from .scene import Liquid, Resolution, StirScene
from .stick import (
    StickState,
    hung,
    inclination,
    inertia,
    levers,
    stopped_at_wall,
    swung,
    wetted,
)
from .surface_points import StickPoints, check_radius, stick_points


class Stir(NamedTuple):
    """How a stick moved, at each step.

    Attributes:
        time: [s], shape [n + 1], from 0.
        pivot: Where the stick hangs, from the middle of the cup's floor [m], shape [n + 1, 3].
        inclination: From the downward vertical in the xz and the yz plane [rad], shape [n + 1, 2].
    """

    time: NDArray[np.float64]
    pivot: NDArray[np.float64]
    inclination: NDArray[np.float64]


class _State(NamedTuple):
    """What one step takes from the one before."""

    flow: Flow
    stick: StickState
    wall: Surface
    stick_force: NDArray[np.float64]


def reference_stir(
    scene: StirScene,
    liquid: Liquid,
    path: GripperPath,
    resolution: Resolution,
    *,
    seconds: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Stir:
    """Stir a liquid at rest.

    Args:
        scene: Cup, stick and filling.
        liquid: Its viscosity and density.
        path: Of the gripper, from which the stick hangs.
        resolution: Of grid and time. Cells become a little smaller or larger, so that a whole
            number of them fills the cup.
        seconds: How long; the path's duration by default.
        progress: Told the fraction that is done, from 0 to 1, after each step.

    Raises:
        ValueError: the stick is thinner than two cells, or lighter than the liquid in its place.
        FloatingPointError: the solution grew without end; take a shorter step.
    """
    seconds = path.duration if seconds is None else seconds
    steps = resolution.steps(seconds)
    box = Box.around_cup(scene.cup_radius, scene.fill, resolution.cell)
    check_radius(scene.stick_radius, box.cell)
    points = stick_points(scene.stick_radius, scene.submerged, box.cell, resolution.drawn_in)
    one_step = _stepper(box, points, scene, liquid, resolution)
    time = resolution.step * np.arange(steps + 1, dtype=np.float64)
    pivots = [_pivot(path, moment, scene) for moment in time]
    wall = standing_wall(box, scene.cup_radius, resolution.drawn_in)
    state = _State(still(box), hung(scene.tilt), wall, np.zeros((len(points.along), 3)))
    directions = [state.stick.direction]
    for done in range(steps):
        kinematic = liquid.kinematic(time[done] / seconds)
        state = one_step(state, pivots[done], kinematic)
        if not np.isfinite(state.stick.direction).all():
            raise FloatingPointError(
                f"the stick is nowhere after {time[done + 1]:.4g} s of {seconds:.4g} s; "
                f"take a step shorter than {resolution.step} s"
            )
        directions.append(state.stick.direction)
        if progress is not None:
            progress((done + 1) / steps)
    place = np.array([pivot.position for pivot in pivots])
    return Stir(time, place, np.array([inclination(one) for one in directions]))


def _pivot(path: GripperPath, time: float, scene: StirScene) -> Motion:
    """Motion of the pivot, its place told from the middle of the cup's floor."""
    motion = path.motion(time)
    return motion._replace(position=motion.position + np.array([0.0, 0.0, scene.pivot_height]))


def _stepper(
    box: Box, points: StickPoints, scene: StirScene, liquid: Liquid, resolution: Resolution
) -> Callable[[_State, Motion, float], _State]:
    """A function that takes state, pivot and kinematic viscosity to the state a step later."""
    moments = inertia(scene, liquid.density)
    step = resolution.step

    def one_step(state: _State, pivot: Motion, kinematic: float) -> _State:
        arms = levers(state.stick, points, scene.stick_length)
        surface = wetted(box, points, arms, pivot, state.stick.spin, state.stick_force)
        flow, (surface, wall) = advanced(
            box, state.flow, (surface, state.wall), kinematic, resolution
        )
        torque = np.cross(arms, immersed.pull(surface, liquid.density)).sum(0)
        stick = swung(state.stick, torque, pivot, scene, moments, step)
        ahead = pivot.position + step * pivot.velocity
        stick = stopped_at_wall(stick, ahead, pivot.velocity, scene)
        return _State(flow, stick, wall, surface.force)

    return one_step
