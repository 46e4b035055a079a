from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.models import runtime
from bolfi_liquids.models.pouring import PourBatch

from bolfi_liquids import models

RATE = np.radians(180.0)
PARTICLES = 900


@pytest.fixture(scope="module")
def setup(glycerin):
    return models.StirSetup.from_recording(glycerin)


@pytest.fixture(scope="module")
def path(glycerin, setup):
    """Two seconds of the recording, sampled at every second step."""
    every = 2.0 * setup.step(glycerin.gripper)
    time = glycerin.gripper.time[0] + every * np.arange(int(2.0 / every))
    seen, position = glycerin.gripper.time, glycerin.gripper.position
    at = [np.interp(time, seen, position[:, axis]) for axis in range(3)]
    return SimpleNamespace(time=time, position=np.column_stack(at))


@pytest.fixture(scope="module")
def oil():
    return models.Liquid(0.1, 0.2, 900.0)


def test_the_stick_in_the_frames_inclines_as_stir_says(oil, setup, path):
    effects = {"pivot_friction": 2e-4}
    rate = 0.5 / setup.step(path)
    frames = models.stir_frames(oil, path, setup, 3, rate=rate, effects=effects)
    signal = models.stir(oil, path, setup, [3], effects)[0]
    np.testing.assert_allclose(frames.time, path.time, atol=1e-9)
    np.testing.assert_allclose(frames.pivot, path.position, atol=2e-4)  # over a step
    stick = frames.tip - frames.pivot
    assert np.linalg.norm(stick, axis=1) == pytest.approx(setup.stick.length, rel=1e-6)
    inclination = np.arctan2(stick[:, :2], -stick[:, 2:])
    assert np.ptp(signal) > np.radians(2.0)
    np.testing.assert_allclose(inclination, signal, rtol=0.0, atol=1e-6)
    np.testing.assert_array_equal(frames.inclination, signal)


def test_frames_of_a_stir_hold_all_particles_in_the_cup(oil, setup, path):
    frames = models.stir_frames(oil, path, setup, 3)
    assert frames.position.shape[1] == pytest.approx(setup.particles, rel=0.03)
    assert frames.position.dtype == np.float32 and np.isfinite(frames.position).all()
    assert np.hypot(*frames.position[..., :2].T).max() < setup.cup.radius
    assert frames.position[..., 2].min() > 0.0
    assert np.diff(frames.time)[:-1] == pytest.approx(1 / 25.0, abs=setup.step(path))
    # the volume of the liquid is where it is: half of it below half of its depth
    assert np.median(frames.position[0, :, 2]) == pytest.approx(setup.cup.fill / 2, rel=0.1)


def test_what_a_sensor_does_is_not_in_the_frames(oil, setup, path):
    """Tilted cameras saw the same stick lean more."""
    more = replace(setup, tilt=(setup.tilt[0] + 0.05, setup.tilt[1]))
    frames = models.stir_frames(oil, path, more, 3, effects={"camera_tilt": 0.05})
    plain = models.stir_frames(oil, path, setup, 3)
    np.testing.assert_allclose(frames.tip, plain.tip, atol=1e-6)


@pytest.mark.slow
def test_looking_changes_no_bit(oil, cups):
    """Whatever the rate of the frames, and of what lands."""
    some, many = (
        models.pour_frames(PourBatch(oil, RATE, cups, [2], PARTICLES), rate=rate)
        for rate in (10.0, 73.0)
    )
    landed = models.landings(oil, RATE, cups, [2], PARTICLES)
    np.testing.assert_array_equal(some.position[-1], many.position[-1])
    np.testing.assert_array_equal(some.landed.position, landed.position)
    np.testing.assert_array_equal(many.landed.retained, landed.retained)


@pytest.mark.slow
def test_what_is_in_the_source_in_the_end_is_what_landings_retain(cups):
    thick = models.Liquid(20.0, 0.5, 1260.0)
    frames = models.pour_frames(PourBatch(thick, RATE, cups, [0], PARTICLES))
    landed = models.landings(thick, RATE, cups, [0], PARTICLES)
    turned = np.minimum(RATE * frames.time, cups.pour.final_angle)
    np.testing.assert_allclose(frames.angle, turned)
    x, y, z = frames.position[-1].T
    c, s = np.cos(frames.angle[-1]), np.sin(frames.angle[-1])
    radius, height = cups.source.radius, cups.source.height
    across, up = c * x - s * z + radius, s * x + c * z + height  # in the turned cup's frame
    inside = (np.hypot(across, y) < radius + 1e-4) & (0.0 < up) & (up < height)
    assert 0 < inside.mean() < 1
    assert inside.mean() == pytest.approx(landed.retained[0])


@pytest.mark.slow
def test_nothing_comes_back_from_below_the_rim(oil, cups):
    frames = models.pour_frames(PourBatch(oil, RATE, cups, [2], PARTICLES))
    landed = models.landings(oil, RATE, cups, [2], PARTICLES)
    present = np.isfinite(frames.position).all(axis=-1).sum(axis=1)
    assert present[0] == landed.position.shape[1] and present[-1] < present[0] / 2
    assert (np.diff(present) <= 0).all()
    assert (np.isnan(frames.position).any(-1) == np.isnan(frames.position).all(-1)).all()
    drop = cups.pour.lip_height - cups.receiver.height
    assert np.nanmin(frames.position[..., 2]) > -drop - 1e-6
    start = frames.position[0] + [cups.source.radius, 0.0, cups.source.height]
    assert np.hypot(*start[:, :2].T).max() < cups.source.radius


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan])
def test_a_rate_that_is_none_is_refused(oil, cups, setup, path, rate):
    with pytest.raises(ValueError, match="frames: rate must be"):
        models.pour_frames(PourBatch(oil, RATE, cups, [0]), rate=rate)
    with pytest.raises(ValueError, match="frames: rate must be"):
        models.stir_frames(oil, path, setup, 0, rate=rate)


def test_frames_of_several_pours_are_refused(oil, cups):
    """They would show the first alone."""
    with pytest.raises(ValueError, match="seeds must be one integer, got 2"):
        models.pour_frames(PourBatch(oil, RATE, cups, [0, 1], PARTICLES))


@pytest.mark.slow
def test_a_pour_that_goes_wrong_has_no_frames(cups):
    runtime.start()
    sound = PourBatch(models.Liquid(20.0, 0.5, 1260.0), RATE, cups, [0], PARTICLES)
    count = models.pour_frames(sound, rate=2.0).position.shape[1]
    with pytest.warns(models.FailedSimulation):
        frames = models.pour_frames(sound._replace(liquid=models.Liquid(3e38, 0.0, 1e3)), rate=2.0)
    assert np.isnan(frames.position).all()
    assert frames.position.shape == (len(frames.time), count, 3) and len(frames.time) > 1


def test_a_stir_that_goes_wrong_has_no_frames(setup, path):
    runtime.start()  # Taichi warns when it is imported
    with pytest.warns(models.FailedSimulation):
        frames = models.stir_frames(models.Liquid(3e38, 0.0, 1e3), path, setup, 0)
    assert np.isnan(frames.position).all() and np.isnan(frames.tip).all()
