"""A long cylinder driven through the liquid in two dimensions, where truths are known."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import immersed_boundary as immersed
from .box import Box
from .flow import advanced, standing_wall, still
from .gripper_paths import GripperPath, Motion
from .immersed_boundary import Surface
from .scene import Liquid, Resolution
from .surface_points import check_radius, layered_ring, points_around


@dataclass(frozen=True)
class CylinderScene:
    """A cylinder in a tank whose sides slip, or in a cup whose wall holds the liquid.

    Attributes:
        radius: Of the cylinder [m].
        tank: Length along x and width along y of the liquid [m]; at least the cup's diameter and
            three cells, if there is one.
        cup_radius: [m]; None for no cup.
    """

    radius: float
    tank: tuple[float, float]
    cup_radius: float | None = None


class CylinderForce(NamedTuple):
    """Force of the liquid on the cylinder.

    Attributes:
        time: [s], shape [n].
        velocity: Of the cylinder [m/s], shape [n, 3].
        force: Per length [N/m], shape [n, 3].
    """

    time: NDArray[np.float64]
    velocity: NDArray[np.float64]
    force: NDArray[np.float64]


def force_on_cylinder(
    scene: CylinderScene,
    liquid: Liquid,
    path: GripperPath,
    resolution: Resolution,
    *,
    seconds: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> CylinderForce:
    """Drive a cylinder along a path, one layer of cells high.

    Args:
        scene: Cylinder and tank.
        liquid: At rest at first.
        path: Of the cylinder's axis, from the middle of the tank.
        resolution: Of grid and time.
        seconds: How long; the path's duration by default.
        progress: Told the fraction that is done, from 0 to 1, after each step.

    Raises:
        ValueError: the cylinder is thinner than two cells, or the cup does not fit the tank.
    """
    steps = resolution.steps(path.duration if seconds is None else seconds)
    cell = resolution.cell
    check_radius(scene.radius, cell)
    box = _slab(scene, cell)
    cup = scene.cup_radius
    walls = [] if cup is None else [standing_wall(box, cup, resolution.drawn_in)]
    flow, force, rows = still(box), None, []
    for done in range(steps):
        time = done * resolution.step
        motion = path.motion(time)
        ring = _ring(box, scene, resolution, motion, force)
        kinematic = liquid.kinematic(done / steps)
        flow, (ring, *walls) = advanced(box, flow, [ring, *walls], kinematic, resolution)
        force = ring.force
        # the points drive the liquid within them too, which a solid cylinder does not hold
        inner = liquid.density * math.pi * scene.radius**2 * motion.acceleration
        rows.append(
            (time, motion.velocity, immersed.pull(ring, liquid.density).sum(0) / cell + inner)
        )
        if progress is not None:
            progress((done + 1) / steps)
    return CylinderForce(*(np.array(column) for column in zip(*rows, strict=True)))


def _slab(scene: CylinderScene, cell: float) -> Box:
    """One layer of cells that slips above and below."""
    length, width = (2 * math.ceil(0.5 * side / cell - 1e-9) for side in scene.tank)
    if scene.cup_radius is not None and min(length, width) * cell < 2 * scene.cup_radius + 3 * cell:
        raise ValueError(
            f"a cup of {scene.cup_radius} m radius does not fit a tank of {scene.tank} m; "
            "leave three cells more than its diameter"
        )
    return Box((length, width, 1), cell, floor_holds=False)


def _ring(
    box: Box,
    scene: CylinderScene,
    resolution: Resolution,
    motion: Motion,
    force: NDArray[np.float64] | None,
) -> Surface:
    """The cylinder's surface where it is."""
    inner = scene.radius - resolution.drawn_in * box.cell
    x, y, _ = motion.position
    points, volume = layered_ring(box, inner, points_around(inner, box.cell), (x, y))
    whole = np.ones(len(points))
    return Surface(
        immersed.stencil(box, points, whole),
        whole,
        volume * whole,
        np.tile(motion.velocity, (len(points), 1)),
        np.zeros_like(points) if force is None else force,
    )
