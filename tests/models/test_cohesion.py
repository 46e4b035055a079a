"""Cohesion: a weightless liquid keeps its momenta, becomes round and breaks into drops."""

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from bolfi_liquids import models

pytestmark = pytest.mark.slow  # kernels compile for ten seconds and more

SPACING = 0.006
DENSITY = 1000.0
COHESIONS = (0.1, 0.5, 1.0)
SLOTS, MOST = 4, 640


@pytest.fixture(scope="module")
def run(weightless):
    """Runs free bodies of liquids side by side."""
    fluid = weightless(SLOTS, MOST, SPACING, [(-0.1, -0.1, -0.25), (0.1, 0.1, 0.25)])

    def run(points, viscosity, cohesions, seconds, velocity=0.0):
        """Positions and velocities [b, particles, 3] of `points` that start at `velocity`."""
        slots, particles = len(cohesions), len(points)
        fluid.place([points] * slots)
        start = np.zeros((SLOTS, MOST, 3), np.float32)
        start[:slots, :particles] = velocity
        fluid.velocity.from_numpy(start)
        fluid.pour_in(models.Liquid(viscosity, np.array(cohesions), DENSITY).batch(slots))
        fluid.step(slots, round(seconds * fluid.rate))
        ended = (field.to_numpy() for field in (fluid.position, fluid.velocity))
        return [values[:slots, :particles].astype(float) for values in ended]

    return run


def block(*counts, seed=0):
    """A slightly disordered lattice about the origin."""
    axes = [SPACING * (np.arange(n) - (n - 1) / 2) for n in counts]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    return points + np.random.default_rng(seed).normal(0.0, 0.05 * SPACING, points.shape)


def moments(points):
    """Principal moments of inertia per mass [m²], in rising order."""
    second = np.linalg.eigvalsh(np.cov(points.T))
    return second.sum() - second[::-1]


def roundness(points):
    """Mean of x⁴ + y⁴ + z⁴ over the squared mean of r²: 0.59 for a cube, 0.71 for a ball."""
    centred = points - points.mean(axis=0)
    return np.mean((centred**4).sum(axis=1)) / np.mean((centred**2).sum(axis=1)) ** 2


def drops(points, spacing=SPACING):
    """Particles of each drop: those that chains of neighbours hold together."""
    tree = cKDTree(points)
    near = tree.sparse_distance_matrix(tree, 1.7 * spacing)
    return np.bincount(connected_components(near)[1])


def test_linear_and_angular_momentum_are_kept(run):
    """In 50 steps at speeds of 5 cm/s, up to the rounding of float32."""
    points = block(5, 6, 7)
    velocity = np.random.default_rng(1).normal(0.0, 0.05, points.shape) + np.cross(
        [0.0, 0.0, 2.0], points
    )
    before = velocity.mean(axis=0), np.cross(points, velocity).mean(axis=0)
    for viscosity in (0.0, 0.3):
        for x, v in zip(*run(points, viscosity, [0.0, 1.0], 0.3, velocity), strict=True):
            assert np.linalg.norm(v.mean(axis=0) - before[0]) < 1e-6
            turning = np.cross(x, v).mean(axis=0)
            assert np.linalg.norm(turning - before[1]) < 1e-4 * np.linalg.norm(before[1])


def test_a_cube_becomes_a_quiet_ball(run):
    start = block(8, 8, 8)
    positions, velocities = run(start, 0.05, [0.0, *COHESIONS], 3.0)
    spread = np.sqrt(moments(start).sum())
    assert roundness(start) < 0.61
    assert np.sqrt(moments(positions[0]).sum()) > 1.5 * spread  # nothing holds it together
    for points, velocity in zip(positions[1:], velocities[1:], strict=True):
        least, _, most = moments(points)
        assert least > 0.95 * most
        assert roundness(points) == pytest.approx(5.0 / 7.0, abs=0.03)
        # a ball of this volume has 0.968 of the cube's spread
        assert np.sqrt(moments(points).sum()) == pytest.approx(0.968 * spread, rel=0.04)
        assert len(drops(points)) == 1
        assert np.sqrt((velocity**2).sum(axis=1).mean()) < 0.01


@pytest.mark.parametrize("viscosity", [0.003, 0.05])
def test_small_drops_neither_evaporate_nor_collapse(run, viscosity):
    positions, _ = run(block(3, 3, 3), viscosity, COHESIONS, 3.0)
    for points in positions:
        assert len(drops(points)) == 1
        nearest = cKDTree(points).query(points, 2)[0][:, 1]
        assert nearest.mean() > 0.6 * SPACING


def test_stronger_cohesion_breaks_a_column_into_larger_drops(run):
    """A column pulled apart along its axis, and shaken, for a second."""
    start = block(4, 4, 40)
    noise = np.random.default_rng(2).normal(0.0, 0.05, start.shape)
    positions, _ = run(start, 0.05, COHESIONS, 1.0, start * [-2.0, -2.0, 4.0] + noise)
    sizes = [np.mean(drops(points)) for points in positions]
    assert sizes[0] < sizes[1] < sizes[2]
    assert 1.5 * sizes[0] < sizes[2] < 0.5 * len(start)


def test_a_bar_contracts_towards_a_ball(run):
    start = block(5, 5, 20)
    positions, _ = run(start, 0.05, COHESIONS, 6.0)
    least, _, most = moments(start)
    assert least < 0.2 * most
    for points in positions:
        least, _, most = moments(points)
        assert least > 0.6 * most
        assert len(drops(points)) == 1
