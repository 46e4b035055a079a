"""Analysis on data made up from known answers."""

import numpy as np
import pytest
from bolfi_liquids.models.validation.analysis import motion, profiles, shapes
from bolfi_liquids.models.validation.truths import shear_flows

GAP = 0.04


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def lattice(*counts):
    axes = [np.arange(n) - (n - 1) / 2 for n in counts]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def test_a_profile_is_the_mean_of_each_bin():
    profile = profiles.binned_profile([0.0, 0.1, 0.9, 2.0], [1.0, 3.0, 5.0, 7.0], 0.0, 1.0, 4)
    np.testing.assert_allclose(profile.at, [0.05, 0.9])
    np.testing.assert_allclose(profile.mean, [2.0, 5.0])
    assert profile.particles.tolist() == [2, 1]
    with pytest.raises(ValueError, match="no particle"):
        profiles.binned_profile([5.0], [1.0], 0.0, 1.0, 4)


def test_viscosity_of_a_poiseuille_flow_whatever_its_slip(rng):
    z = rng.uniform(0, GAP, 2000)
    flow = shear_flows.poiseuille_steady(z, gap=GAP, gradient=700.0, viscosity=0.8)
    noisy = flow + 0.03 + rng.normal(0, 0.002, z.size)
    fit = profiles.fit_poiseuille(z, noisy, GAP, 700.0)
    assert fit.viscosity == pytest.approx(0.8, rel=0.01)
    assert fit.slip == pytest.approx((0.03, 0.03), abs=1e-3)
    assert fit.rms == pytest.approx(0.002, rel=0.1)
    assert profiles.fit_poiseuille(z, -flow, GAP, 700.0).viscosity == np.inf
    # a plug bends as little as it likes
    assert profiles.fit_poiseuille(z, 0.5 * flow, GAP, 700.0).viscosity == pytest.approx(1.6)


def test_slip_of_a_couette_flow():
    z = np.linspace(0.002, 0.038, 30)
    fit = profiles.fit_couette(z, 0.02 + 4.0 * z, GAP, 0.2)
    assert fit.shear_rate == pytest.approx(4.0)
    assert fit.slip == pytest.approx((0.02, -0.02))
    assert fit.rms < 1e-12


@pytest.mark.parametrize("kinematic", [2e-4, 1e-3, 5e-3])
def test_viscosity_of_a_start_up(rng, kinematic):
    z, times = np.linspace(0.001, 0.039, 20), np.array([0.05, 0.1, 0.3])

    def flow(viscosity):
        return shear_flows.couette_startup(z, times, gap=GAP, speed=0.2, kinematic=viscosity)

    noisy = flow(kinematic) + rng.normal(0, 0.001, (3, 20))
    noisy[1, 3] = np.nan
    fit = profiles.fit_kinematic_viscosity(flow, noisy, 1e-5, 1e-1)
    assert fit.kinematic == pytest.approx(kinematic, rel=0.02)
    assert fit.rms == pytest.approx(0.001, rel=0.3)
    with pytest.raises(ValueError, match="low < high"):
        profiles.fit_kinematic_viscosity(flow, noisy, 1e-1, 1e-5)


def test_a_waves_amplitude_and_decay_on_scattered_particles(rng):
    x, wave_number, times = rng.uniform(0, 0.1, 800) ** 1.2, 150.0, np.linspace(0, 1, 6)
    wave = 0.1 * np.exp(-3.0 * times)[:, None] * np.cos(wave_number * x + 0.7)
    velocity = 0.5 + wave + rng.normal(0, 1e-4, wave.shape)
    amplitude = profiles.wave_amplitude(np.broadcast_to(x, wave.shape), velocity, wave_number)
    assert amplitude[0] == pytest.approx(0.1, rel=1e-3)
    assert profiles.decay_rate(times, amplitude) == pytest.approx(3.0, rel=1e-2)
    with pytest.raises(ValueError, match="positive"):
        profiles.decay_rate(times, amplitude - 0.05)


def test_front_and_height_leave_out_spray():
    block = 0.01 * (lattice(6, 4, 8) + [2.5, 1.5, 3.5] + 0.5)
    spray = np.array([[1.0, 0, 0.9], [0.9, 0, 0.8]])
    both = np.stack([np.concatenate([block, spray])] * 2)
    np.testing.assert_allclose(shapes.front_position(both, 0.01, strays=2), 0.06)
    np.testing.assert_allclose(shapes.column_height(block, 0.01, 0.03), 0.08)
    np.testing.assert_allclose(shapes.column_height(both, 0.01, 0.03), [0.08, 0.08])
    assert np.isnan(shapes.column_height(block + 1.0, 0.01, 0.03))
    with pytest.raises(ValueError, match="no front"):
        shapes.front_position(block[:2], 0.01)


def test_shapes_tell_balls_cubes_and_bars_apart(rng):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    bar = lattice(30, 10, 10) @ turn + 5.0
    assert shapes.principal_moment_ratio(bar) == pytest.approx(np.sqrt(99 / 899))
    cube = lattice(15, 15, 15)
    ball = lattice(31, 31, 31)
    ball = ball[np.linalg.norm(ball, axis=1) < 15]
    assert shapes.principal_moment_ratio(cube) == pytest.approx(1.0)
    assert shapes.principal_moment_ratio(ball) == pytest.approx(1.0)
    assert shapes.roundness(cube) == pytest.approx(0.596, abs=0.01)
    assert shapes.roundness(ball) == pytest.approx(5 / 7, abs=0.01)
    assert shapes.principal_moment_ratio(np.stack([cube, 2 * cube])).shape == (2,)


def test_pieces_are_counted():
    one = lattice(4, 4, 4)
    far = np.concatenate([one, one[:10] + 20.0, [[50.0, 0, 0]]])
    assert shapes.cluster_sizes(far, 1.1).tolist() == [64, 10, 1]
    assert shapes.count_clusters(far, 1.1) == 3
    assert shapes.count_clusters(far, 1.1, smallest=5) == 2
    assert shapes.count_clusters(far, 0.9) == 75
    assert shapes.count_clusters(far, 100.0) == 1


def test_density_of_a_full_box_is_one():
    points = 0.01 * (lattice(10, 10, 12) + [0, 0, 6.0])
    slabs = shapes.density_by_height(points, 0.01, 0.01, 0.03)
    np.testing.assert_allclose(slabs.density, 1.0)
    np.testing.assert_allclose(slabs.height, [0.015, 0.045, 0.075, 0.105])


def test_speeds_and_energies():
    velocity = np.zeros((2, 4, 3))
    velocity[1, :, 0], velocity[1, :, 2] = 3.0, 4.0
    np.testing.assert_allclose(motion.rms_speed(velocity), [0, 5])
    np.testing.assert_allclose(motion.kinetic_energy(velocity, 0.5), [0, 25])
    np.testing.assert_allclose(motion.mean_velocity(velocity)[1], [3, 0, 4])


@pytest.mark.parametrize("decay", [0.0, 0.6])
def test_period_and_decay_of_a_swing(decay):
    time = np.arange(0, 4, 1 / 240)
    signal = 0.2 + 0.1 * np.exp(-decay * time) * np.cos(2 * np.pi * time / 0.63 + 0.4)
    swing = motion.oscillation(time, signal, 0.2)
    assert swing.period == pytest.approx(0.63, rel=1e-3)
    assert swing.decay == pytest.approx(decay, abs=0.01)
    fit = motion.fit_damped_oscillation(time, signal, 0.55)
    assert fit == pytest.approx((0.63, decay, 0.1, 0.2), rel=1e-4, abs=1e-6)


def test_a_signal_that_does_not_swing_is_refused():
    with pytest.raises(ValueError, match="3 passages"):
        motion.oscillation(np.arange(9.0), np.arange(9.0) - 4)


def test_a_strongly_damped_swing_is_fitted(rng):
    time = np.arange(0, 2, 1 / 100)
    signal = 0.3 * np.exp(-3 * time) * np.cos(2 * np.pi * time / 0.7) + rng.normal(0, 1e-3, 200)
    fit = motion.fit_damped_oscillation(time, signal, 0.6)
    assert fit.period == pytest.approx(0.7, rel=0.02)
    assert fit.decay == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize("decay", [0.0, 1.5])
def test_the_far_side_of_a_swing(decay):
    time = 0.5 + np.arange(0, 2, 1 / 240)
    angle = 2 * np.pi * (time - 0.5) / 0.7
    start = np.cos(angle) + decay * 0.7 / (2 * np.pi) * np.sin(angle)  # released at rest
    signal = 0.1 - 0.3 * np.exp(-decay * (time - 0.5)) * start
    far = motion.far_side(time, signal, 0.1)
    assert far.time == pytest.approx(0.35, abs=1 / 240)
    assert far.ratio == pytest.approx(np.exp(-decay * 0.35), rel=1e-3)


def test_an_overdamped_swing_has_no_far_side():
    far = motion.far_side(np.arange(9.0), np.exp(-np.arange(9.0)))
    assert np.isnan(far.time) and np.isnan(far.ratio)
