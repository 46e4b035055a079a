"""Parts of the Navier-Stokes reference: transforms, advection, surface points, stick and paths."""

import numpy as np
import pytest
from stirring_reference import (
    Motion,
    StirScene,
    advection,
    circle,
    immersed_boundary,
    polygon,
    star,
    stick,
)
from stirring_reference.box import (
    Box,
    diffused,
    divergence,
    inside,
    projected,
)
from truths import pendulum

BOX = Box((8, 6, 5), 2e-3)


def random_velocity(box, seed=0):
    """At rest on the box's sides."""
    random, velocity = np.random.default_rng(seed), box.at_rest()
    for component, values in enumerate(velocity):
        values[inside(component)] = random.normal(size=values[inside(component)].shape)
    return velocity


def norm(velocity):
    return np.sqrt(sum((q**2).sum() for q in velocity))


@pytest.mark.parametrize("box", [BOX, Box((8, 6, 1), 2e-3, floor_holds=False)], ids=["box", "slab"])
def test_projection_takes_the_divergence_and_nothing_else(box):
    velocity = random_velocity(box)
    free, potential = projected(box, velocity)
    assert potential.shape == box.shape
    assert np.abs(divergence(box, free)).max() < 1e-10 * np.abs(divergence(box, velocity)).max()
    removed = tuple(a - b for a, b in zip(velocity, free, strict=True))
    product = sum((a * b).sum() for a, b in zip(removed, free, strict=True))
    assert abs(product) < 1e-10 * norm(velocity) ** 2
    again, _ = projected(box, free)
    for a, b in zip(again, free, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12)


def test_viscosity_solves_its_equation_with_the_walls_images():
    """new - ν dt ∇² new = old; no slip at the floor, slip at sides and lid."""
    reach, old = 3.0 * BOX.cell**2, random_velocity(BOX)
    new = diffused(BOX, old, reach)
    for component, values in enumerate(new):
        laplacian = np.zeros_like(values)
        for axis in range(3):
            if axis == component:
                wide = values
            else:
                low, high = (np.take(values, [end], axis) for end in (0, -1))
                wide = np.concatenate([-low if axis == 2 else low, values, high], axis)
            second = np.diff(wide, 2, axis) / BOX.cell**2
            laplacian[inside(component)] += (
                second if axis == component else second[inside(component)]
            )
        left = (values - reach * laplacian)[inside(component)]
        np.testing.assert_allclose(left, old[component][inside(component)], atol=1e-10)


def test_advection_moves_a_wave_with_the_stream():
    """Far from the sides, x velocity 1 + a sin(k y) in a cross stream: -V ∂u/∂y."""
    box = Box((8, 40, 3), 1e-3, floor_holds=False)
    u, v, w = box.at_rest()
    y = box.first_face(0)[1] + box.cell * np.arange(40)
    k = 2.0 * np.pi / 0.02
    u += np.sin(k * y)[None, :, None]
    v += 0.7
    rate = advection.advection(box, (u, v, w))[0]
    expected = -0.7 * k * np.cos(k * y)
    np.testing.assert_allclose(rate[4, 5:-5, 1], expected[5:-5], atol=0.03 * 0.7 * k)


def test_advection_neither_makes_nor_loses_momentum_but_at_the_sides():
    """A flow that is at rest within two cells of the box's sides keeps its sum."""
    box = Box((12, 12, 12), 1e-3)
    velocity = random_velocity(box)
    for values in velocity:
        values[:3] = values[-3:] = values[:, :3] = values[:, -3:] = 0.0
        values[:, :, :3] = values[:, :, -3:] = 0.0
    for rate in advection.advection(box, velocity):
        assert abs(rate.sum()) < 1e-10 * np.abs(rate).sum()


@pytest.mark.parametrize("place", [0.0, 0.2, 0.5, 0.77])
def test_the_smoothed_delta_sums_to_one_about_its_point(place):
    nodes = np.arange(-3, 5)
    weights = immersed_boundary.smoothed_delta(nodes - place)
    assert weights.sum() == pytest.approx(1.0)
    assert (weights * nodes).sum() == pytest.approx(place, abs=1e-12)
    assert (weights**2).sum() == pytest.approx(0.5)


def test_points_give_the_liquid_what_they_see_of_it():
    """Seeing and pushing are adjoint, and a push is found whole in the liquid."""
    points = np.array([[1e-3, 0.5e-3, 5e-3], [-2e-3, 1e-3, 4.4e-3]])
    share, zeros = np.array([1.0, 0.3]), np.zeros((2, 3))
    at = immersed_boundary.stencil(BOX, points, share)
    volume = np.array([2.0, 3.0]) * BOX.cell**3
    surface = immersed_boundary.Surface(at, share, volume, zeros, zeros)
    change = np.random.default_rng(1).normal(size=(2, 3))
    pushed = immersed_boundary.pushed(BOX, BOX.at_rest(), surface, change)
    momentum = [q.sum() * BOX.cell**3 for q in pushed]
    np.testing.assert_allclose(momentum, (share * volume) @ change, rtol=1e-12)
    velocity = random_velocity(BOX)
    inner = sum((a * b).sum() for a, b in zip(pushed, velocity, strict=True)) * BOX.cell**3
    seen = immersed_boundary.seen(velocity, at)
    assert inner == pytest.approx((seen * change * volume[:, None]).sum())


def test_a_stick_in_thin_air_swings_with_its_period():
    scene = StirScene(tilt=(0.05, 0.0), pivot_damping=0.0)
    density, step = 1e-6, 2e-4
    rest = Motion(np.array([0.0, 0.0, scene.pivot_height]), np.zeros(3), np.zeros(3))
    state, moments = stick.hung(scene.tilt), stick.inertia(scene, density)
    angles = []
    for _ in range(8000):
        state = stick.swung(state, np.zeros(3), rest, scene, moments, step)
        angles.append(stick.inclination(state.direction)[0])
    upward = np.flatnonzero((np.array(angles)[:-1] < 0) & (np.array(angles)[1:] >= 0))
    period = pendulum.period_in_air(0.05, scene.rod)
    assert np.diff(upward).mean() * step == pytest.approx(period, rel=1e-3)
    assert max(np.abs(angles[-4000:])) == pytest.approx(0.05, rel=1e-2)


def test_a_stick_at_an_angle_is_lifted_by_archimedes():
    scene, density = StirScene(tilt=(0.1, 0.0), pivot_damping=0.0), 900.0
    rest = Motion(np.array([0.0, 0.0, scene.pivot_height]), np.zeros(3), np.zeros(3))
    moments = stick.inertia(scene, density)
    state = stick.swung(stick.hung(scene.tilt), np.zeros(3), rest, scene, moments, 1e-3)
    depth = scene.pivot_height - scene.fill
    torque = pendulum.archimedes_torque(0.1, scene.rod, depth, density)
    assert np.linalg.norm(state.spin) == pytest.approx(
        1e-3 * torque / (moments.stick - moments.inner)
    )


def test_the_wall_stops_a_stick_that_swings_into_it():
    scene = StirScene()
    inclined = stick.hung((0.17, 0.0)).direction
    place, still = np.array([0.0, 0.0, scene.pivot_height]), np.zeros(3)
    state = stick.StickState(inclined, np.array([0.0, -2.0, 0.5]))
    after = stick.stopped_at_wall(state, place, still, scene)
    end = place + scene.stick_length * after.direction
    assert np.hypot(*end[:2]) + scene.stick_radius == pytest.approx(scene.cup_radius, abs=1e-4)
    outward = np.cross(after.spin, scene.stick_length * inclined)
    assert outward[0] == pytest.approx(0.0, abs=1e-12)
    inwards = state._replace(spin=-state.spin)
    np.testing.assert_array_equal(
        stick.stopped_at_wall(inwards, place, still, scene).spin, inwards.spin
    )
    free = state._replace(direction=np.array([0.0, 0.0, -1.0]))
    assert stick.stopped_at_wall(free, place, still, scene) is free


PATHS = {
    "star": star(0.025, 0.1),
    "polygon": polygon([[0.0, 0.0], [0.002, 0.0], [0.002, 0.03]], 0.1),
    "circle": circle(0.02, 0.08, turns=2),
}


@pytest.mark.parametrize("name", PATHS)
def test_velocity_and_acceleration_are_those_of_the_path(name):
    path = PATHS[name]
    times = np.linspace(0.0, path.duration, 4001)
    position, velocity, acceleration = (
        np.array(part) for part in zip(*map(path.motion, times), strict=True)
    )
    step = times[1] - times[0]
    moved = np.cumsum(0.5 * step * (velocity[1:] + velocity[:-1]), axis=0)
    np.testing.assert_allclose(position[1:] - position[0], moved, atol=2e-5)
    gained = np.cumsum(0.5 * step * (acceleration[1:] + acceleration[:-1]), axis=0)
    np.testing.assert_allclose(velocity[1:], gained, atol=1e-2)
    assert np.abs(velocity[[0, -1]]).max() == np.abs(acceleration[[0, -1]]).max() == 0.0
    assert np.linalg.norm(velocity, axis=1).max() <= 0.1 + 1e-12


def test_paths_reach_what_they_name():
    tips = PATHS["star"]
    np.testing.assert_allclose(tips.motion(99.0).position, [0.025, 0, 0], atol=1e-12)
    np.testing.assert_allclose(PATHS["polygon"].motion(99.0).position, [0.002, 0.03, 0], atol=1e-12)
    np.testing.assert_allclose(PATHS["circle"].motion(99.0).position, [0.02, 0, 0], atol=1e-12)
    assert tips.duration == pytest.approx(6.68, abs=0.01)


def test_paths_that_are_none_are_refused():
    with pytest.raises(ValueError, match="twice in a row"):
        polygon([[0, 0], [0, 0]], 0.1)
    with pytest.raises(ValueError, match="shape"):
        polygon([[0, 0, 0]], 0.1)
    with pytest.raises(ValueError, match="positive"):
        polygon([[0, 0], [1, 0]], 0.0)
    with pytest.raises(ValueError, match="star of 9 points"):
        star(0.02, 0.1, skip=3)
    with pytest.raises(ValueError, match="two ramps"):
        circle(0.02, 0.1, turns=0.1)
