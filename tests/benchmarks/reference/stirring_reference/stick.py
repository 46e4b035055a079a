"""The stick as a spherical pendulum in the liquid, and where it meets the cup's wall."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from truths.pendulum import GRAVITY

from . import immersed_boundary as immersed
from .box import Box
from .gripper_paths import Motion
from .immersed_boundary import Surface
from .scene import StirScene
from .surface_points import StickPoints

UP = np.array([0.0, 0.0, 1.0])
SLIDING = 0.02  # rad/s below which dry friction fades, so that it does not make the stick tremble
FLATTEST = 0.2  # cosine of the inclination, below which the wet length is no longer lengthened


class StickState(NamedTuple):
    """How the stick hangs and turns.

    Attributes:
        direction: From the pivot to the lower end, of unit length, shape [3].
        spin: Angular velocity [rad/s], shape [3].
    """

    direction: NDArray[np.float64]
    spin: NDArray[np.float64]


def hung(tilt: tuple[float, float]) -> StickState:
    """At rest, inclined by `tilt` [rad] in the xz and the yz plane."""
    down = np.array([math.tan(tilt[0]), math.tan(tilt[1]), -1.0])
    return StickState(down / np.linalg.norm(down), np.zeros(3))


def inclination(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle from the downward vertical in the xz and the yz plane [rad], shape [2]."""
    return np.arctan2(direction[:2], -direction[2])


def levers(state: StickState, points: StickPoints, length: float) -> NDArray[np.float64]:
    """From the pivot to each point of the stick [m], shape [n, 3]."""
    first = np.cross(state.direction, [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(state.direction, first)
    axial = (length - points.along)[:, None] * state.direction
    return axial + points.across[:, :1] * first + points.across[:, 1:] * second


def wetted(
    box: Box,
    points: StickPoints,
    arms: NDArray[np.float64],
    pivot: Motion,
    spin: NDArray[np.float64],
    force: NDArray[np.float64],
) -> Surface:
    """The stick's surface in the liquid; points fade out within a cell around the lid.

    Args:
        arms: `levers` of the points [m], shape [n, 3].
        pivot: Its place is told from the cup's floor.
        spin: Angular velocity [rad/s].
        force: Of each point, from the step before [m/s²], shape [n, 3].
    """
    places = pivot.position + arms
    share = np.clip((box.shape[2] * box.cell - places[:, 2]) / box.cell + 0.5, 0.0, 1.0)
    velocity = pivot.velocity + np.cross(spin, arms)
    return Surface(immersed.stencil(box, places, share), share, points.volume, velocity, force)


class Inertia(NamedTuple):
    """Of the stick and of the liquid in its place, about the pivot.

    Attributes:
        displaced: Mass of liquid per wet length [kg/m].
        stick: Moment of inertia of the stick [kg m²].
        inner: Moment of inertia of the liquid within its surface [kg m²].
        inner_lever: First moment of that liquid [kg m].
    """

    displaced: float
    stick: float
    inner: float
    inner_lever: float


def inertia(scene: StirScene, density: float) -> Inertia:
    """Of a scene's stick in liquid of `density` [kg/m³].

    Raises:
        ValueError: the stick is so light that the liquid within its surface outweighs it.
    """
    rod, dry = scene.rod, scene.stick_length - scene.submerged
    displaced = density * rod.area
    inner = displaced * (rod.length**3 - dry**3) / 3.0
    if inner >= 0.95 * rod.inertia:
        raise ValueError(
            f"the stick's moment of inertia, {rod.inertia:.3g} kg m², must exceed that of the "
            f"liquid in its place, {inner:.3g} kg m²; take a heavier stick or less liquid"
        )
    return Inertia(displaced, rod.inertia, inner, 0.5 * displaced * (rod.length**2 - dry**2))


def swung(
    state: StickState,
    torque: NDArray[np.float64],
    pivot: Motion,
    scene: StirScene,
    moments: Inertia,
    step: float,
) -> StickState:
    """The stick a step later.

    The liquid within the points moves as the stick does, and they drive it: its inertia is taken
    back, as by Uhlmann 2005. Pressure at rest is no part of the flow; its lift is Archimedes'.

    Args:
        torque: Of the flow about the pivot [N m], shape [3].
        pivot: Its place is told from the cup's floor.
        step: [s].
    """
    direction, spin = state
    friction = scene.pivot_damping + scene.dry_friction / max(float(np.linalg.norm(spin)), SLIDING)
    whole = (
        torque
        + _weight(direction, pivot, scene)
        + np.cross(direction * _lift(direction, pivot, scene, moments.displaced), UP)
        + np.cross(direction * moments.inner_lever, pivot.acceleration)
        - friction * spin
    )
    spin = spin + step * _across(whole, direction) / (moments.stick - moments.inner)
    spin = _across(spin, direction)
    turned = direction + step * np.cross(spin, direction)
    return StickState(turned / np.linalg.norm(turned), spin)


def _weight(direction: NDArray, pivot: Motion, scene: StirScene) -> NDArray[np.float64]:
    """Torque of gravity, and of the pivot's acceleration [N m]."""
    pull = scene.rod.mass * (-GRAVITY * UP - pivot.acceleration)
    return np.cross(0.5 * scene.stick_length * direction, pull)


def _lift(direction: NDArray, pivot: Motion, scene: StirScene, displaced: float) -> float:
    """Archimedes' force times its lever [N m], by the exact wet length."""
    dry = (pivot.position[2] - scene.fill) / max(-direction[2], FLATTEST)
    return 0.5 * (scene.stick_length**2 - dry**2) * displaced * GRAVITY


def _across(vector: NDArray, direction: NDArray) -> NDArray[np.float64]:
    """The part of a vector across the stick; it does not spin about itself."""
    return vector - (vector @ direction) * direction


def stopped_at_wall(
    state: StickState,
    place: NDArray[np.float64],
    velocity: NDArray[np.float64],
    scene: StirScene,
) -> StickState:
    """The stick whose end does not enter the cup's wall: it stops dead, without friction.

    Args:
        place, velocity: Of the pivot [m, m/s], shape [3].
    """
    direction, spin = state
    arm = scene.stick_length * direction
    end = place + arm
    distance = math.hypot(end[0], end[1])
    excess = distance + scene.stick_radius - scene.cup_radius
    if excess <= 0.0:
        return state
    outward = np.array([end[0], end[1], 0.0]) / distance
    lever = np.cross(arm, outward)
    approach = float((velocity + np.cross(spin, arm)) @ outward)
    spin = spin - max(approach, 0.0) * lever / (lever @ lever)
    direction = direction - excess / scene.stick_length * _across(outward, direction)
    return StickState(direction / np.linalg.norm(direction), spin)
