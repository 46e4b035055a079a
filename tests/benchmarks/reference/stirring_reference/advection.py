"""What the flow carries along: conservative, by quadratic upstream interpolation.

Leonard 1979 (Comput. Methods Appl. Mech. Eng. 19, 59), QUICK.
"""

import numpy as np
from numpy.typing import NDArray

from .box import VERTICAL, Box, Velocity, inside, part


def advection(box: Box, velocity: Velocity) -> Velocity:
    """Acceleration [m/s²] of the liquid by what flows into and out of each face's cell."""
    u, v, w = (_component(box, velocity, component) for component in range(3))
    return u, v, w


def _component(box: Box, velocity: Velocity, component: int) -> NDArray[np.float64]:
    own = inside(component)
    rate = np.zeros(box.faces(component))
    for axis in (component, *(a for a in range(3) if a != component)):
        if axis == component:
            carried = velocity[component]
        else:
            carried = _beyond_walls(box, velocity[component][own], axis)
        carrier = _between(velocity[axis], component)
        rate[own] -= np.diff(_flux(carried, carrier, axis), axis=axis) / box.cell
    return rate


def _beyond_walls(box: Box, values: NDArray, axis: int) -> NDArray[np.float64]:
    """One node more on either side: the mirror image where the wall slips, its negative else."""
    low, high = values[part(axis, None, 1)], values[part(axis, -1, None)]
    held = axis == VERTICAL and box.floor_holds
    return np.concatenate([-low if held else low, values, high], axis)


def _between(values: NDArray, axis: int) -> NDArray[np.float64]:
    return 0.5 * (values[part(axis, None, -1)] + values[part(axis, 1, None)])


def _flux(carried: NDArray, carrier: NDArray, axis: int) -> NDArray[np.float64]:
    """What the carrier, given between the nodes, takes across from node to node."""
    first, last = carried[part(axis, None, 1)], carried[part(axis, -1, None)]
    wide = np.concatenate([first, carried, last], axis)
    before, low, high, after = (
        wide[part(axis, start, stop)] for start, stop in ((0, -3), (1, -2), (2, -1), (3, None))
    )
    centred = 0.5 * (low + high) - (before - low - high + after) / 16.0
    upstream = (after - 3.0 * high + 3.0 * low - before) / 16.0
    return carrier * centred + np.abs(carrier) * upstream
