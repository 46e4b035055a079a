"""A box of liquid on a staggered grid: its viscosity and its pressure, by fast transforms.

Component `a` of the velocity stands in the middle of the faces across axis `a`. The box's sides
and its lid let the liquid slip along them; the floor holds it, or lets it slip too.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, dctn, dst, idct, idctn, idst

Velocity = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Components on the faces [m/s]: of the box's shape, but for one more along their own axis."""

VERTICAL = 2


@dataclass(frozen=True)
class Box:
    """Cubic cells; the z axis runs through the middle, from the floor up.

    Attributes:
        shape: Cells along x, y and z.
        cell: Width of a cell [m].
        floor_holds: Whether the floor holds the liquid.
    """

    shape: tuple[int, int, int]
    cell: float
    floor_holds: bool = True

    @classmethod
    def around_cup(cls, radius: float, fill: float, cell: float) -> "Box":
        """A box whose lid is the liquid's surface; its cells are `cell` [m] wide, or nearly."""
        high = max(round(fill / cell), 1)
        width = fill / high
        # the points of the cup's wall stand behind it, and reach a cell and a half
        across = 2 * math.ceil(radius / width + 1.5)
        return cls((across, across, high), width)

    @property
    def corner(self) -> NDArray[np.float64]:
        """x, y and z of the lowest corner [m]."""
        return -0.5 * self.cell * np.array([self.shape[0], self.shape[1], 0.0])

    def faces(self, component: int) -> tuple[int, ...]:
        """How many faces carry a component, along x, y and z."""
        return tuple(n + (axis == component) for axis, n in enumerate(self.shape))

    def first_face(self, component: int) -> NDArray[np.float64]:
        """Middle of the first face that carries a component [m]."""
        return self.corner + self.cell * np.where(np.arange(3) == component, 0.0, 0.5)

    def at_rest(self) -> Velocity:
        """No motion anywhere."""
        u, v, w = (np.zeros(self.faces(component)) for component in range(3))
        return u, v, w


def part(axis: int, start: int | None, stop: int | None) -> tuple[slice, ...]:
    """Index of a part of a grid along one axis."""
    return tuple(slice(start, stop) if a == axis else slice(None) for a in range(3))


def inside(component: int) -> tuple[slice, ...]:
    """Index of the faces that are not the box's own sides."""
    return part(component, 1, -1)


class _Modes(NamedTuple):
    """Waves along one axis that meet its two walls, and how fast diffusion ends them.

    Attributes:
        forward, back: Transforms along an axis.
        kind: Of the transform.
        decay: Eigenvalues of minus the second difference [1/m²], shape [modes].
    """

    forward: Callable[..., Any]  # SciPy tells its type checkers another result
    back: Callable[..., Any]
    kind: int
    decay: NDArray[np.float64]


def _modes(box: Box, component: int, axis: int) -> _Modes:
    n = box.shape[axis]
    if axis == component:  # nothing flows through the walls
        return _Modes(dst, idst, 1, _decay(np.arange(1, n), n, box.cell))
    if axis == VERTICAL and box.floor_holds:  # odd about the floor, even about the lid
        return _Modes(dst, idst, 4, _decay(np.arange(n) + 0.5, n, box.cell))
    return _Modes(dct, idct, 2, _decay(np.arange(n), n, box.cell))


def _decay(number: NDArray, n: int, cell: float) -> NDArray[np.float64]:
    return (2.0 - 2.0 * np.cos(np.pi * number / n)) / cell**2


def _sum_over_axes(x: NDArray, y: NDArray, z: NDArray) -> NDArray[np.float64]:
    return x[:, None, None] + y[None, :, None] + z


def diffused(box: Box, velocity: Velocity, reach: float) -> Velocity:
    """Velocity after an implicit step of viscosity: (1 - ν dt ∇²) new = old.

    Args:
        reach: ν dt [m²].
    """
    u, v, w = (_diffused(box, q, component, reach) for component, q in enumerate(velocity))
    return u, v, w


def _diffused(
    box: Box, values: NDArray[np.float64], component: int, reach: float
) -> NDArray[np.float64]:
    waves = values[inside(component)]
    if waves.size == 0:  # a slab of one layer has no vertical motion
        return values
    modes = [_modes(box, component, axis) for axis in range(3)]
    for axis, along in enumerate(modes):
        waves = along.forward(waves, type=along.kind, axis=axis, norm="ortho")
    waves = waves / (1.0 + reach * _sum_over_axes(*(along.decay for along in modes)))
    for axis, along in enumerate(modes):
        waves = along.back(waves, type=along.kind, axis=axis, norm="ortho")
    new = values.copy()
    new[inside(component)] = waves
    return new


def divergence(box: Box, velocity: Velocity) -> NDArray[np.float64]:
    """Of the flow out of each cell [1/s], of the box's shape."""
    in_x, in_y, in_z = (np.diff(q, axis=axis) for axis, q in enumerate(velocity))
    return (in_x + in_y + in_z) / box.cell


def without_gradient(box: Box, velocity: Velocity, potential: NDArray[np.float64]) -> Velocity:
    """Velocity less the gradient of a potential [m²/s] that is given in the cells."""

    def less(values: NDArray, axis: int) -> NDArray[np.float64]:
        new = values.copy()
        new[inside(axis)] -= np.diff(potential, axis=axis) / box.cell
        return new

    u, v, w = (less(values, axis) for axis, values in enumerate(velocity))
    return u, v, w


def projected(box: Box, velocity: Velocity) -> tuple[Velocity, NDArray[np.float64]]:
    """The part of a velocity that is free of divergence, and the potential of the rest [m²/s].

    Chorin 1968 (Math. Comput. 22, 745). The sides' own faces must be at rest.
    """
    decay = _sum_over_axes(*(_decay(np.arange(n), n, box.cell) for n in box.shape))
    decay[0, 0, 0] = 1.0  # a constant has no gradient, and none is looked for
    waves = -np.asarray(dctn(divergence(box, velocity), type=2, norm="ortho")) / decay
    waves[0, 0, 0] = 0.0
    potential = np.asarray(idctn(waves, type=2, norm="ortho"))
    return without_gradient(box, velocity, potential), potential
