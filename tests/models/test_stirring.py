from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.models import trajectory
from bolfi_liquids.models.apic.places import Places
from bolfi_liquids.models.stirs.slip_law import PIVOT_DAMPING
from scipy.integrate import solve_ivp

from bolfi_liquids import models

CAMERA_NOISE = 0.1  # deg


def rms_deg(difference):
    return np.degrees(np.sqrt(np.mean(np.square(difference), axis=(-2, -1))))


def first_seconds(recording, seconds):
    keep = recording.gripper.time <= seconds
    path = SimpleNamespace(
        time=recording.gripper.time[keep], position=recording.gripper.position[keep]
    )
    return SimpleNamespace(
        attrs=recording.attrs, gripper=path, inclination=recording.inclination[keep]
    )


def hanging(recording):
    """Its setup, with a stick that hangs straight down at the start."""
    return replace(models.StirSetup.from_recording(recording), tilt=(0.0, 0.0))


@pytest.mark.slow
def test_same_bits_again_alone_and_anywhere_in_a_batch(glycerin):
    short = first_seconds(glycerin, 1.0)
    setup = models.StirSetup.from_recording(short)
    viscosity = np.array([0.01, 1.0, 0.1, 5.0, 0.003])
    seeds = np.array([5, 1, 7, 1, 3])

    def run(order):
        liquid = models.Liquid(viscosity[order], 0.2, 1260.0)
        return models.stir(liquid, short.gripper, setup, seeds[order])

    order = np.arange(5)
    whole = run(order)
    assert np.ptp(whole[:, -1, 0]) > 0.0
    np.testing.assert_array_equal(run(order), whole)
    np.testing.assert_array_equal(run(order[::-1]), whole[::-1])
    np.testing.assert_array_equal(run(order[2:3]), whole[2:3])
    many = np.tile(order, 3)  # more than march together
    np.testing.assert_array_equal(run(many), whole[many])


@pytest.mark.slow
def test_without_liquid_the_stick_is_the_driven_spherical_pendulum(glycerin):
    """Lagrange's equation of a rod on a moving pivot, integrated by SciPy, is the truth."""
    gripper, wide = glycerin.gripper, replace(hanging(glycerin).cup, radius=0.1)
    setup = replace(hanging(glycerin), cup=wide, particles=1500)  # no wall within its reach
    thin = models.Liquid(viscosity=0.0, cohesion=0.0, density=1e-3)
    signal = models.stir(thin, gripper, setup, [0])[0]

    step = setup.step(gripper)
    path = trajectory.step_path(gripper, step)
    grid = gripper.time[0] + np.arange(len(path)) * step
    acceleration = np.gradient(np.gradient(path, step, axis=0), step, axis=0)
    stick = setup.stick
    arm = stick.mass * stick.length / 2 / stick.inertia

    def rhs(t, state):
        u, w = state[:3], state[3:]
        pivot = np.array([np.interp(t, grid, acceleration[:, axis]) for axis in range(3)])
        force = arm * (np.array([0.0, 0.0, -9.81]) - pivot) - PIVOT_DAMPING / stick.inertia * w
        return np.concatenate([w, force - force.dot(u) * u - w.dot(w) * u])

    start = [0.0, 0.0, -1.0, 0.0, 0.0, 0.0]
    solved = solve_ivp(
        rhs, (grid[0], gripper.time[-1]), start, t_eval=gripper.time, max_step=2e-3, rtol=1e-7
    )
    expected = np.arctan2(solved.y[:2], -solved.y[2]).T
    swing = rms_deg(expected)
    assert swing > 2.0
    assert rms_deg(signal - expected) < 0.05 * swing


@pytest.mark.slow
@pytest.mark.parametrize("name, bar", [("oil_v10", 0.36), ("glycerin_v10", 0.1)])
def test_the_stick_moves_as_the_reference_s(reference, name, bar):
    """Navier-Stokes under a rigid lid, with camera noise of 0.1 deg, at the true parameters."""
    recording, truth = reference(name)
    setup = models.StirSetup.from_recording(recording)
    setup = replace(setup, cup=replace(setup.cup, fill=truth["fill"]))
    liquid = models.Liquid(truth["viscosity"], 0.0, recording.attrs["liquid_density"])
    signal = models.stir(liquid, recording.gripper, setup, [0])[0]
    apart = rms_deg(signal - recording.inclination)
    assert apart**2 - CAMERA_NOISE**2 <= bar**2


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.1, 0.8])
def test_no_particle_is_ever_outside_the_cup(water, speed):
    """Looked at after every other step of the first strokes, also of a violent stir."""
    x = 0.03 * np.sin(2.0 * np.pi * speed / 0.12 * np.arange(0.0, 1.5, 1 / 30))
    position = np.column_stack([x, 0.0 * x, np.full(len(x), water.gripper.position[0, 2])])
    path = SimpleNamespace(time=np.arange(len(x)) / 30, position=position)
    setup = hanging(water)
    rate = 0.5 / setup.step(path)
    for viscosity, density in ((0.0, 1000.0), (1e-3, 700.0), (10.0, 1300.0)):
        liquid = models.Liquid(viscosity, 0.0, density)
        seen = models.stir_frames(liquid, path, setup, 0, rate=rate).position
        assert np.isfinite(seen).all()
        assert np.hypot(seen[..., 0], seen[..., 1]).max() < setup.cup.radius
        assert seen[..., 2].min() > 0.0
        assert seen[..., 2].max() < setup.cup.height


@pytest.mark.slow
def test_liquid_at_rest_stays_at_rest(water):
    setup = hanging(water)
    time = np.linspace(0.0, 2.0, 61)
    still = SimpleNamespace(time=time, position=np.tile(water.gripper.position[0], (61, 1)))
    liquid = models.Liquid([1e-3, 1.0], 0.0, 1000.0)
    signal = models.stir(liquid, still, setup, [0, 0])
    assert np.abs(np.degrees(signal)).max() < 0.03
    water_alone = models.Liquid(1e-3, 0.0, 1000.0)
    frames = models.stir_frames(water_alone, still, setup, 0, rate=2.0)
    level = 2.0 * frames.position[..., 2].mean(axis=1)
    assert level == pytest.approx(setup.cup.fill, rel=0.005)


def test_a_stick_that_starts_inclined_is_simulated_so(glycerin):
    setup = models.StirSetup.from_recording(glycerin)
    assert setup.tilt == pytest.approx(glycerin.inclination[:5].mean(axis=0), abs=2e-3)
    short = first_seconds(glycerin, 0.2)
    signal = models.stir(models.Liquid(1.0, 0.2, 1260.0), short.gripper, setup, [0])
    assert signal[0, 0] == pytest.approx(np.array(setup.tilt), abs=1e-6)
    unseen = SimpleNamespace(attrs=glycerin.attrs, gripper=glycerin.gripper)
    assert models.StirSetup.from_recording(unseen).tilt == (0.0, 0.0)


@pytest.mark.parametrize("rate", [10.0, 500.0])
def test_the_path_is_the_same_at_every_rate_of_samples(rate):
    """A circle, and noise of an arm's encoders, which must not become acceleration."""
    time, step = np.arange(0.0, 3.0, 1.0 / rate), 0.012
    angle = 2.0 * np.pi * 0.6 * time
    circle = np.column_stack([0.02 * np.cos(angle), 0.02 * np.sin(angle), 0.0 * time])
    noise = 5e-6 * np.random.default_rng(0).standard_normal(circle.shape) * (rate > 100.0)
    path = trajectory.step_path(SimpleNamespace(time=time, position=circle + noise), step)[10:-10]
    turned = 2.0 * np.pi * 0.6 * step * (10 + np.arange(len(path)))
    truth = np.column_stack([0.02 * np.cos(turned), 0.02 * np.sin(turned), 0.0 * turned])
    assert np.abs(path - truth).max() < 1e-4
    acceleration = np.diff(path - truth, 2, axis=0) / step**2
    assert np.sqrt(np.mean(acceleration**2)) < 0.15  # m/s²; the circle's is 0.28


def test_steps_follow_cells_and_speed(glycerin):
    setup, gripper = models.StirSetup.from_recording(glycerin), glycerin.gripper
    assert setup.cell == pytest.approx(0.005, rel=1e-3)
    assert setup.step(gripper) == pytest.approx(0.012, rel=1e-3)
    time = gripper.time[0] + (gripper.time - gripper.time[0]) / 4.0
    fast = SimpleNamespace(time=time, position=gripper.position)
    speed = np.linalg.norm(np.diff(fast.position, axis=0), axis=1).max() * 120.0
    assert setup.step(fast) == pytest.approx(0.4 * setup.cell / speed, rel=0.05)
    thin = replace(setup.stick, radius=0.002)
    assert replace(setup, stick=thin, particles=0).cell == pytest.approx(0.002 / 0.9, rel=1e-3)
    with pytest.warns(models.UntestedResolution, match="0.26 cells"):
        models.StirSetup.from_recording(glycerin, particles=100)


def test_a_setup_says_what_fixes_it(glycerin):
    setup = models.StirSetup.from_recording(glycerin, particles=5000)
    settings = setup.settings()
    assert settings["particles"] == 5000
    assert settings["model"] == models.MODEL_VERSION
    assert settings["numerics"]["longest_step"] == setup.numerics.longest_step
    assert settings["tilt"] == setup.tilt
    volume = setup.particles * setup.spacing**3
    displaced = np.pi * setup.stick.radius**2 * setup.submerged
    cup = np.pi * setup.cup.radius**2 * setup.cup.fill
    assert volume + displaced == pytest.approx(cup)


def test_missing_geometry_and_a_short_stick_are_named(glycerin):
    attrs = {key: value for key, value in glycerin.attrs.items() if key != "cup_radius"}
    with pytest.raises(ValueError, match="cup_radius"):
        models.StirSetup.from_recording(SimpleNamespace(attrs=attrs, gripper=glycerin.gripper))
    attrs = {**glycerin.attrs, "stick_length": 0.1}
    with pytest.raises(ValueError, match="above the liquid.*stick_length=0.1"):
        models.StirSetup.from_recording(SimpleNamespace(attrs=attrs, gripper=glycerin.gripper))


def test_a_path_without_samples_is_refused(glycerin):
    setup = models.StirSetup.from_recording(glycerin, particles=100)
    gap = SimpleNamespace(time=np.array([0.0, 1.0]), position=np.full((2, 3), np.nan))
    with pytest.raises(ValueError, match="0 finite samples"):
        models.stir(models.Liquid(1.0, 0.0, 1000.0), gap, setup, [0])


@pytest.mark.parametrize("seeds", [[], [0.5], [-1]])
def test_bad_seeds_are_named(glycerin, seeds):
    setup = models.StirSetup.from_recording(glycerin, particles=100)
    with pytest.raises(ValueError, match="seeds must be integers"):
        models.stir(models.Liquid(1.0, 0.0, 1000.0), glycerin.gripper, setup, seeds)


@pytest.mark.parametrize("size", [1, 3, 8])
def test_few_stirs_are_shared_among_all_groups(size):
    slots = Places(size, 2, 4).slots
    assert len(set(slots)) == size and slots.max() < 8
    by_group = np.bincount(slots // 4, minlength=2)
    assert np.ptp(by_group) <= 1
