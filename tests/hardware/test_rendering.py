"""The renderer, against formulae written out here."""

import dataclasses
import time

import numpy as np
import pytest
from bolfi_liquids.hardware.board import SPAWN
from bolfi_liquids.hardware.rendering import (
    WorldState,
    exposure_times,
    prepare,
    render,
)
from bolfi_liquids.hardware.rendering.world import ROWS, SharedWorld
from rendered_scenes import CLEAN, rehearsal_camera, rehearsal_scene

pytest.importorskip("cv2")

RNG = np.random.default_rng(0)


def state(xz_deg: float, yz_deg: float = 0.0, pivot=(0.0, 0.0, 0.235)) -> WorldState:
    return WorldState(0.0, np.array(pivot, dtype=float), np.radians([xz_deg, yz_deg]))


def picture(states, look=CLEAN, *, distortion=(0.0,) * 5, **sizes) -> np.ndarray:
    scene = dataclasses.replace(rehearsal_scene("xz"), **sizes)
    stage = prepare(scene, rehearsal_camera("xz", distortion=distortion), look)
    return render(stage, states, np.random.default_rng(1))


def dark_centroids(image: np.ndarray, rows: range, background: float) -> np.ndarray:
    weight = np.clip(background - image[rows.start : rows.stop].astype(float), 0, None)
    return weight @ np.arange(image.shape[1]) / weight.sum(axis=1)


@pytest.mark.parametrize("angle_deg", [0.4, -21.0, 44.0])
def test_the_stick_leans_as_much_as_it_should(angle_deg):
    # a camera that looks horizontally at the stick's plane shows angles in it as they are
    look = dataclasses.replace(CLEAN, background=200.0)
    scene = dataclasses.replace(rehearsal_scene("xz"), fill=0.0, cup_height=0.001)
    camera = dataclasses.replace(
        rehearsal_camera("xz", height=0.13), position=np.array([0.0, -0.45, 0.13])
    )
    image = render(prepare(scene, camera, look), [state(angle_deg)], RNG)
    rows = range(120, 270)
    slope = np.polyfit(np.arange(rows.start, rows.stop), dark_centroids(image, rows, 200.0), 1)[0]
    assert np.degrees(np.arctan(slope)) == pytest.approx(angle_deg, abs=0.01)


def test_a_moving_stick_is_smeared_about_the_middle_of_the_exposure():
    moving = [state(angle) for angle in (3.0, 5.0, 7.0)]
    sizes = {"fill": 0.0, "cup_height": 0.001}
    smeared, still = picture(moving, **sizes), picture([state(5.0)], **sizes)
    rows = range(120, 300)
    apart = dark_centroids(smeared, rows, 190.0) - dark_centroids(still, rows, 190.0)
    assert np.abs(apart).max() < 0.15
    assert (smeared[280] < 180).sum() > (still[280] < 180).sum() + 5


def test_a_lens_that_distorts_bends_the_stick():
    sizes = {"fill": 0.0, "cup_height": 0.001}
    image = picture([state(30.0)], distortion=(-0.3, 0.0, 0.0, 0.0, 0.0), **sizes)
    rows = np.arange(120, 330)
    middle = dark_centroids(image, range(120, 330), 190.0)
    bent = middle - np.polyval(np.polyfit(rows, middle, 1), rows)
    # the points of a straight line, by the formula of the radial distortion
    t = np.linspace(0.02, 0.2, 400)
    along = np.column_stack([t * np.sin(np.radians(30)), 0 * t, 0.235 - t * np.cos(np.radians(30))])
    camera = rehearsal_camera("xz")
    x, y, z = camera.to_camera(along).T
    radial = 1.0 - 0.3 * ((x / z) ** 2 + (y / z) ** 2)
    expected = np.interp(rows, 239.5 + 640 * y / z * radial, 319.5 + 640 * x / z * radial)
    np.testing.assert_allclose(middle, expected, atol=0.1)
    assert np.ptp(bent) > 0.5


def test_noise_has_the_strength_that_was_asked_for():
    look = dataclasses.replace(CLEAN, read_noise=2.0, shot_noise=0.05)
    clean, noisy = picture([state(0.0)]), picture([state(0.0)], look)
    difference = (noisy.astype(float) - clean)[:100, :150]
    assert difference.std() == pytest.approx(np.hypot(2.0, np.sqrt(0.05 * 190)), rel=0.05)
    assert abs(difference.mean()) < 0.1


def test_exposures_surround_their_middle_and_a_gripper_out_of_view_leaves_the_backdrop():
    times = exposure_times(5.0, dataclasses.replace(CLEAN, exposure=0.009))
    np.testing.assert_allclose(times, [4.997, 5.0, 5.003])
    stage = prepare(rehearsal_scene("xz"), rehearsal_camera("xz"), CLEAN)
    away = state(0.0, pivot=(0.0, -2.0, 0.3))
    np.testing.assert_array_equal(render(stage, [away], RNG)[:100], stage.backdrop[:100])


def world_at(host, x=0.0):
    return SharedWorld(host, WorldState(0.0, np.array([x, 0.2, 0.3]), np.zeros(2)))


def test_between_two_states_the_world_is_interpolated_and_the_last_one_stays():
    world = world_at(10.0, 0.5)
    world.write(10.1, WorldState(0.2, np.array([0.6, 0.2, 0.3]), np.array([0.2, -0.1])))
    between = world.state(10.05)
    np.testing.assert_allclose(between.pivot, [0.55, 0.2, 0.3])
    np.testing.assert_allclose(between.inclination, [0.1, -0.05])
    assert between.time == pytest.approx(0.1)
    assert world.state(99.0).pivot[0] == 0.6 and world.state(0.0).pivot[0] == 0.5


def test_older_states_are_forgotten_and_the_rest_is_in_order():
    world = world_at(0.0)
    for k in range(1, 3 * ROWS):
        world.write(float(k), WorldState(2.0 * k, np.full(3, float(k)), np.zeros(2)))
    last = 3 * ROWS - 1
    assert world.state(last - 0.25).time == pytest.approx(2.0 * last - 0.5)
    # the row that a writer may be about to replace is left out
    assert world.state(0.0).pivot[0] == last - ROWS + 2


def write_until(enough, world):
    k = 0.0
    while not enough.is_set():
        for _ in range(ROWS):
            k += 1.0
            world.write(k, WorldState(k, np.full(3, k), np.full(2, k)))


@pytest.mark.usefixtures("importable")
def test_whoever_looks_from_another_process_sees_whole_states_only():
    world, enough = SharedWorld(0.0, WorldState(0.0, np.zeros(3), np.zeros(2))), SPAWN.Event()
    writer = SPAWN.Process(target=write_until, args=(enough, world), daemon=True)
    writer.start()
    end, times = time.monotonic() + 60.0, set()
    try:
        while len(times) < 200 and time.monotonic() < end:
            seen = world.state(np.inf)
            # all numbers of a state are the same here
            assert (seen.pivot == seen.time).all() and (seen.inclination == seen.time).all()
            times.add(seen.time)
    finally:
        enough.set()
        writer.join()
    assert len(times) == 200
