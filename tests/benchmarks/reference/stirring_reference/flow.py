"""One step of the liquid around surfaces that move."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import immersed_boundary as immersed
from .advection import advection
from .box import Box, Velocity, diffused, part, projected, without_gradient
from .immersed_boundary import Surface
from .scene import Resolution
from .surface_points import layered_ring, points_around


class Flow(NamedTuple):
    """State of the liquid.

    Attributes:
        velocity: On the faces [m/s].
        potential: Pressure times step over density [m²/s], of the box's shape.
        carried: Advection of the step before [m/s²]; None before the first.
    """

    velocity: Velocity
    potential: NDArray[np.float64]
    carried: Velocity | None = None


def still(box: Box) -> Flow:
    """Liquid at rest."""
    return Flow(box.at_rest(), np.zeros(box.shape))


def standing_wall(box: Box, radius: float, drawn_in: float) -> Surface:
    """Inside of a cup's wall; its points stand `drawn_in` cells behind it."""
    count = points_around(radius, box.cell)
    points, volume = layered_ring(box, radius + drawn_in * box.cell, count)
    whole, zeros = np.ones(len(points)), np.zeros_like(points)
    return Surface(immersed.stencil(box, points, whole), whole, volume * whole, zeros, zeros)


def advanced(
    box: Box,
    flow: Flow,
    surfaces: Sequence[Surface],
    kinematic: float,
    resolution: Resolution,
) -> tuple[Flow, list[Surface]]:
    """The liquid a step later, and the surfaces with the forces that hold it to them.

    Advection by Adams & Bashforth, implicit viscosity, incremental pressure (Van Kan 1986, SIAM J.
    Sci. Stat. Comput. 7, 870); then the surfaces are imposed and divergence is removed again.

    Args:
        surfaces: Where they are at the step's beginning.
        kinematic: Viscosity over density [m²/s].
    """
    step = resolution.step
    carried = advection(box, flow.velocity)
    velocity = _carried_along(flow, carried, step)
    for surface in surfaces:
        velocity = immersed.pushed(box, velocity, surface, step * surface.force)
    velocity = without_gradient(box, velocity, flow.potential)
    velocity = diffused(box, velocity, kinematic * step)
    velocity, first = projected(box, velocity)
    velocity, surfaces = _imposed(box, velocity, surfaces, resolution)
    velocity, second = projected(box, _closed(velocity))
    return Flow(velocity, flow.potential + first + second, carried), surfaces


def _carried_along(flow: Flow, now: Velocity, step: float) -> Velocity:
    before = now if flow.carried is None else flow.carried
    u, v, w = (
        q + step * (1.5 * a - 0.5 * b) for q, a, b in zip(flow.velocity, now, before, strict=True)
    )
    return u, v, w


def _imposed(
    box: Box, velocity: Velocity, surfaces: Sequence[Surface], resolution: Resolution
) -> tuple[Velocity, list[Surface]]:
    """Velocity that meets the surfaces', and the forces with what that took."""
    held = list(surfaces)
    for _ in range(resolution.sweeps):
        changes = [
            resolution.gain * (s.velocity * s.share[:, None] - immersed.seen(velocity, s.stencil))
            for s in held
        ]
        for i, change in enumerate(changes):
            velocity = immersed.pushed(box, velocity, held[i], change)
            held[i] = held[i]._replace(force=held[i].force + change / resolution.step)
    # a point that has left the liquid comes back without its force of then
    return velocity, [s._replace(force=np.where(s.share[:, None] > 0, s.force, 0.0)) for s in held]


def _closed(velocity: Velocity) -> Velocity:
    """Nothing flows through the box's sides."""
    for axis, values in enumerate(velocity):
        values[part(axis, None, 1)] = 0.0
        values[part(axis, -1, None)] = 0.0
    return velocity
