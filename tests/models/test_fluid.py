"""The liquid by itself: momentum, viscosity and cohesion, away from every wall."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.models import runtime

from bolfi_liquids import models

SPACING = 0.006
DENSITY = 1000.0
STEPS = 12


@pytest.fixture(scope="module")
def free_fluid():
    """Builds a fluid without walls and gravity whose substeps a test can run one by one."""
    runtime.start()
    import taichi as ti
    from bolfi_liquids.models.fluid import Fluid

    @ti.data_oriented
    class FreeFluid(Fluid):
        @ti.func
        def gravity(self, b):
            return ti.math.vec3(0.0)

        @ti.kernel
        def step(self, steps: ti.i32):
            for _ in range(1):
                for _n in range(steps):
                    self.flow(0)

        @ti.kernel
        def diffuse(self, steps: ti.i32):
            """Viscosity alone, between particles that stay where they are."""
            for _ in range(1):
                self.search(0)
                self.measure(0)
                for _n in range(steps):
                    self.couple(0)
                    self.shear(0)

    def build(positions, viscosity, cohesion):
        fluid = FreeFluid(1, len(positions), SPACING, models.Numerics(), [(-0.1,) * 3, (0.1,) * 3])
        fluid.place([positions])
        fluid.pour_in(models.Liquid(viscosity, cohesion, DENSITY).batch(1))
        return fluid

    return build


def cube(side, rng):
    axis = SPACING * (np.arange(side) - (side - 1) / 2)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    return points + rng.normal(0.0, 0.05 * SPACING, points.shape)


@pytest.mark.parametrize("cohesion", [0.0, 1.0])
def test_linear_momentum_is_kept(free_fluid, cohesion):
    rng = np.random.default_rng(0)
    fluid = free_fluid(cube(6, rng), 0.3, cohesion)
    velocity = rng.normal(0.0, 0.05, (1, 216, 3)).astype(np.float32)
    fluid.velocity.from_numpy(velocity)
    fluid.step(60)
    drift = fluid.velocity.to_numpy()[0].mean(axis=0) - velocity[0].mean(axis=0)
    assert np.abs(drift).max() < 1e-5  # of 0.05 m/s, by float32's rounding in 60 steps


def test_viscosity_damps_a_shear_wave_as_its_number_says(free_fluid):
    """A shear wave v_x = cos(k z) of a slab decays at the rate mu k² / rho.

    One wavelength between free faces, at antinodes, where they carry no stress. The pair form
    reaches 0.8 of its nominal viscosity in a bulk this coarse, and 0.6 in a slab with edges; a
    factor of a half or two in it would show.
    """
    rng = np.random.default_rng(1)
    counts = np.array([15, 9, 13])
    axes = [SPACING * (np.arange(n) - (n - 1) / 2) for n in counts]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    # disordered, as liquid is: pairs along a lattice's axes transmit no shear across them
    points += rng.normal(0.0, 0.2 * SPACING, points.shape)
    wave_number = 2.0 * np.pi / (counts[2] * SPACING)
    inside = (np.abs(points[:, :2]) < SPACING * (counts[:2] - 5) / 2).all(axis=1)
    shape = np.cos(wave_number * points[:, 2])
    rates = []
    for viscosity in (0.2, 0.6):
        fluid = free_fluid(points, viscosity, 0.0)
        velocity = np.zeros((1, len(points), 3), np.float32)
        velocity[0, :, 0] = 0.01 * shape
        fluid.velocity.from_numpy(velocity)
        fluid.diffuse(STEPS)
        left = fluid.velocity.to_numpy()[0, inside, 0] @ shape[inside]
        rates.append(-np.log(left / (0.01 * shape[inside] @ shape[inside])) / (STEPS * fluid.dt))
    # the difference cancels what the scheme dissipates at any viscosity
    measured = (rates[1] - rates[0]) / 0.4
    expected = wave_number**2 / DENSITY
    assert 0.45 < measured / expected < 0.95


def test_cohesion_keeps_a_free_cube_together_and_rounds_it(free_fluid):
    """Mean of x⁴ + y⁴ + z⁴ over the squared mean of r²: 0.59 for a cube, 0.71 for a ball.

    Without cohesion nothing holds the cube together.
    """

    def spread(points):
        return np.sqrt(np.mean(np.sum(points**2, axis=1)))

    def roundness(points):
        return np.mean(np.sum(points**4, axis=1)) / spread(points) ** 4

    start = cube(8, np.random.default_rng(2))
    ended = {}
    for cohesion in (0.0, 0.5):
        fluid = free_fluid(start, 0.05, cohesion)
        fluid.step(480)
        points = fluid.position.to_numpy()[0].astype(float)
        ended[cohesion] = points - points.mean(axis=0)
    assert roundness(start) < 0.61
    assert roundness(ended[0.5]) == pytest.approx(5.0 / 7.0, abs=0.03)
    assert spread(ended[0.5]) < 1.1 * spread(start)
    assert spread(ended[0.0]) > 1.5 * spread(start)


def test_stick_and_liquid_exchange_angular_momentum(glycerin):
    """About the pivot, in one substep out of reach of the cup, gravity's share taken off.

    Along the stick's own axis its torque is taken by the gripper, so x and y are compared.
    """
    from bolfi_liquids.models.stirring_kernel import StirringScene

    rng = np.random.default_rng(3)
    setup = models.StirSetup.from_recording(glycerin, particles=343)
    axis = 0.95 * setup.spacing * np.arange(-3, 4)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    points = points[np.hypot(points[:, 0], points[:, 1]) > setup.stick.radius + 0.2 * setup.spacing]
    setup = dataclasses.replace(
        setup, cup=dataclasses.replace(setup.cup, radius=1.0), particles=len(points)
    )
    spacing = 0.0063
    small = SimpleNamespace(
        cup=setup.cup,
        stick=setup.stick,
        particles=len(points),
        spacing=spacing,
        numerics=setup.numerics,
    )
    centre, pivot = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.15])
    for viscosity in (0.0, 5.0):
        scene = StirringScene(1, small)
        scene.place([points + centre])
        scene.velocity.from_numpy(rng.normal(0.0, 0.05, (1, len(points), 3)).astype(np.float32))
        scene.place_stick(pivot[None])
        lean = np.array([np.sin(0.1), 0.0, -np.cos(0.1)])
        scene.direction.from_numpy(lean[None].astype(np.float32))
        scene.swing.from_numpy(2.0 * np.cross([0.0, 1.0, 0.0], lean)[None].astype(np.float32))
        scene.pour_in(models.Liquid(viscosity, 0.0, DENSITY).batch(1))

        mass, inertia = DENSITY * spacing**3, setup.stick.inertia
        gravity = np.array([0.0, 0.0, -9.81]) * scene.dt
        before = _state(scene)
        scene.stir(1, 0, 1, pivot[None, None].astype(np.float32), np.empty((1, 1, 3), np.float32))
        after = _state(scene)

        liquid = [np.cross(x - pivot, mass * v).sum(axis=0) for x, v, _, _ in (before, after)]
        stick = [inertia * np.cross(u, w) for _, _, u, w in (before, after)]
        half_weight = 0.5 * setup.stick.mass * setup.stick.length
        liquid_gain = (
            liquid[1] - liquid[0] - np.cross(before[0] - pivot, mass * gravity).sum(axis=0)
        )
        stick_gain = stick[1] - stick[0] - half_weight * np.cross(before[2], gravity)
        assert np.linalg.norm(liquid_gain[:2]) > 1e-6
        missing = np.linalg.norm((liquid_gain + stick_gain)[:2])
        assert missing < 0.03 * np.linalg.norm(liquid_gain[:2])


def _state(scene):
    fields = (scene.position, scene.velocity, scene.direction, scene.swing)
    position, velocity, direction, swing = (field.to_numpy()[0].astype(float) for field in fields)
    return position, velocity, direction, swing
