"""What single effects do, against closed forms."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.models.stirs.slip_law import PIVOT_DAMPING
from scipy.signal import find_peaks

from bolfi_liquids import models

GRAVITY = 9.81


@pytest.fixture(scope="module")
def setup(glycerin):
    return replace(models.StirSetup.from_recording(glycerin), tilt=(0.0, 0.0), rest=None)


@pytest.fixture
def short(glycerin):
    """Both axes swing from the first sample on, about the cup's axis."""
    time = np.arange(0.0, 0.5, 1.0 / 30.0)
    height = np.full_like(time, glycerin.gripper.position[0, 2])
    x, y = 0.01 * np.sin(9.0 * time), 0.008 * np.sin(7.0 * time)
    return SimpleNamespace(time=time, position=np.column_stack([x, y, height]))


def hook(name):
    effect = models.EFFECTS[name]
    return effect.rig or effect.signal


def angles_of(directions):
    return np.arctan2(directions[..., :2], -directions[..., 2:])


def test_a_late_camera_shows_a_sine_late():
    time, omega, delay = np.arange(0.0, 4.0, 1.0 / 30.0), 8.0, np.array([0.08, 0.1, -0.05])
    angles = np.sin(omega * time)[None, :, None] * np.ones((3, 1, 2))
    seen = hook("camera_delay")(time, angles, delay)
    for trial, late in zip(seen, delay, strict=True):
        moment = np.clip(time - late, time[0], time[-1])
        # a cubic spline errs by 5/384 (omega step)⁴ inside, and more in the end intervals
        inside = (moment > 0.2) & (moment < 3.8)
        expected = np.sin(omega * moment)[:, None]
        assert np.abs(trial - expected)[inside].max() < 2e-4
        assert np.abs(trial - expected).max() < 5e-3
    np.testing.assert_allclose(seen[1, 3:], angles[1, :-3], atol=1e-12)  # 0.1 s are 3 samples


def test_turned_cameras_see_the_direction_in_turned_axes():
    rng = np.random.default_rng(0)
    directions = rng.standard_normal((4, 50, 3))  # above the horizontal, too
    turn = np.array([0.2, -0.7, np.pi / 2, 3.0])
    seen = hook("camera_rotation")(None, angles_of(directions), turn)
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    x, y, z = np.moveaxis(directions, -1, 0)
    expected = angles_of(np.stack([c * x + s * y, c * y - s * x, z], axis=-1))
    np.testing.assert_allclose(np.cos(seen - expected), 1.0, atol=1e-12)
    # cameras turned by a quarter look at +y where they looked at +x
    lean = np.array([[[0.0, np.sin(0.1), -np.cos(0.1)]]])
    quarter = hook("camera_rotation")(None, angles_of(lean), np.array([np.pi / 2]))
    np.testing.assert_allclose(quarter, [[[0.1, 0.0]]], atol=1e-12)


@pytest.mark.parametrize(("name", "plane"), [("camera_tilt", 0), ("camera_tilt_yz", 1)])
def test_a_tipped_frame_shifts_one_plane_and_hardly_the_other(name, plane):
    tilt, lean = np.radians(1.0), np.radians([3.0, 3.0])
    direction = np.array([*np.tan(lean), -1.0])
    c, s = np.cos(tilt), np.sin(tilt)
    tipped = np.eye(3)
    tipped[np.ix_([plane, 2], [plane, 2])] = [[c, -s], [s, c]]
    exact = angles_of(tipped @ direction)
    seen = hook(name)(None, lean[None, None], np.array([tilt]))[0, 0]
    assert seen[plane] == pytest.approx(exact[plane], abs=1e-12)
    assert np.degrees(np.abs(seen - exact)).max() < 0.01


@pytest.mark.slow
def test_mass_matters_only_against_the_liquids(setup, short):
    """The stick's motion knows mu / mass and rho / mass alone, so in air it knows no mass."""
    seeds = [1, 2]
    heavy = models.stir(models.Liquid(0.2, 0.3, 2000.0), short, setup, seeds, {"stick_mass": 2.0})
    plain = models.stir(models.Liquid(0.1, 0.3, 1000.0), short, setup, seeds)
    # but for the pivot's own damping
    np.testing.assert_allclose(heavy, plain, atol=0.01 * np.abs(plain).max())
    light = models.stir(models.Liquid(0.1, 0.3, 1000.0), short, setup, seeds, {"stick_mass": 2.0})
    assert np.abs(light - plain).max() > 1e-3

    empty = {"fill_level": -setup.cup.fill, "stick_mass": [1.0, 1.3]}
    one, other = models.stir(models.Liquid(0.1, 0.3, 1000.0), short, setup, seeds, empty)
    np.testing.assert_allclose(one, other, atol=0.02 * np.abs(one).max())


@pytest.mark.slow
def test_a_scaled_gripper_runs_the_scaled_path(setup, short):
    scaled = SimpleNamespace(time=short.time, position=short.position * [0.5, 0.5, 1.0])
    liquid = models.Liquid(0.1, 0.3, 1000.0)
    expected = models.stir(liquid, scaled, setup, [1])
    seen = models.stir(liquid, short, setup, [1], {"gripper_scale": 0.5})
    np.testing.assert_allclose(seen, expected, atol=1e-3 * np.abs(seen).max())

    path = np.random.default_rng(0).standard_normal((2, 9, 3))
    rig = models.Rig(np.ones(2), np.zeros(2), np.ones(2), path)
    moved = hook("gripper_scale")(rig, np.array([2.0, 0.7])).path - path[:, :1]
    plain = path - path[:, :1]
    np.testing.assert_allclose(moved[..., :2], plain[..., :2] * [[[2.0]], [[0.7]]], atol=1e-12)
    np.testing.assert_allclose(moved[..., 2], plain[..., 2], atol=1e-12)


def test_a_fill_is_a_number_of_particles_of_the_same_size(glycerin):
    setup = models.StirSetup.from_recording(glycerin, particles=1000)
    cup, stick = setup.cup, setup.stick
    fill = cup.fill + np.array([-0.05, -0.02, -0.001, 0.0, 0.001, 0.01, 0.025])
    discs = cup.radius**2 * fill - stick.radius**2 * np.clip(fill - 0.015, 0.0, None)
    counts = setup.count(fill)
    assert np.abs(counts * setup.spacing**3 - np.pi * discs).max() < 0.6 * setup.spacing**3
    assert counts[0] == 0 and counts[3] == 1000


@pytest.mark.slow
def test_more_liquid_stands_higher(setup, short):
    """The particles' mean height is half the depth."""
    still = SimpleNamespace(time=short.time[:2], position=np.tile(short.position[0], (2, 1)))
    liquid = models.Liquid(0.05, 0.0, 1000.0)
    for level in (-0.015, 0.0, 0.02):
        effects = {"fill_level": level}
        frames = models.stir_frames(liquid, still, setup, 0, effects=effects)
        height = frames.position[-1, :, 2].mean()
        assert height == pytest.approx((setup.cup.fill + level) / 2, rel=0.005)


def kicked(setup):
    """A gripper that jerks by 2 cm and then stands still for 4 s, seen at every step."""
    time = np.arange(0.0, 4.0, setup.numerics.step(setup.cell, 0.0))
    position = np.zeros((len(time), 3))
    position[:, 0] = 0.02 * np.clip(time / 0.1, 0.0, 1.0)
    position[:, 2] = setup.cup.fill - setup.submerged + setup.stick.length
    return SimpleNamespace(time=time, position=position)


@pytest.mark.slow
def test_dry_friction_takes_the_same_angle_from_every_swing(setup):
    """I θ'' + k θ = -τ sign(θ') swings about -τ/k and τ/k in turns: 4 τ/k is lost each cycle.

    The pivot's viscous damping c takes besides exp(-c π / (2 I ω)) of each half of a swing.
    """
    stiffness = setup.stick.mass * GRAVITY * setup.stick.length / 2
    torque, path = np.array([0.0, 2e-5, 4e-5, 8e-5]), kicked(setup)
    effects = {"fill_level": -setup.cup.fill, "pivot_friction": torque}
    liquid = models.Liquid(0.0, 0.0, 1000.0)
    swings = models.stir(liquid, path, setup, np.zeros(4, int), effects)[..., 0]
    for swing, tau in zip(swings, torque, strict=True):
        free = np.abs(swing[path.time > 0.1])
        peaks = free[find_peaks(free)[0]]
        peaks = peaks[peaks > 3.0 * tau / stiffness]  # those from which it swings on
        assert len(peaks) >= 5
        rubbed = 2 * tau / stiffness
        kept = np.exp(-PIVOT_DAMPING * np.pi / (2.0 * np.sqrt(stiffness * setup.stick.inertia)))
        lost = rubbed + (1.0 - kept) * (peaks[:-1] - rubbed / 2)
        np.testing.assert_allclose(-np.diff(peaks), lost, rtol=0.02, atol=2e-3 * peaks[0])


@pytest.mark.slow
def test_dry_friction_holds_a_stick_that_leans_little(setup):
    """It stops at an angle below τ/k, and stays there but for rounding."""
    stiffness = setup.stick.mass * GRAVITY * setup.stick.length / 2
    torque = 4e-4
    effects = {"fill_level": -setup.cup.fill, "pivot_friction": torque}
    signal = models.stir(models.Liquid(0.0, 0.0, 1000.0), kicked(setup), setup, [0], effects)[0]
    rest = signal[-100:]
    assert np.ptp(rest, axis=0).max() < 1e-8
    assert 0.0 < np.abs(rest[0, 0]) < torque / stiffness


def test_friction_damps_in_liquid_too(setup, short):
    liquid = models.Liquid(0.1, 0.0, 1000.0)
    free, rubbed, held = models.stir(
        liquid, short, setup, [1, 1, 1], {"pivot_friction": [0.0, 5e-4, 1.0]}
    )
    assert np.abs(rubbed).max() < np.abs(free).max()
    assert np.abs(held).max() == 0.0


@pytest.mark.slow
def test_the_fill_of_one_is_nothing_to_another(setup, short):
    liquid, seeds = models.Liquid(0.1, 0.3, 1000.0), np.arange(4)
    levels = np.array([0.004, -0.003, 0.0, 0.012])
    whole = models.stir(liquid, short, setup, seeds, {"fill_level": levels})
    back = models.stir(liquid, short, setup, seeds[::-1], {"fill_level": levels[::-1]})
    np.testing.assert_array_equal(back[::-1], whole)
    np.testing.assert_array_equal(models.stir(liquid, short, setup, seeds[2:3]), whole[2:3])
