"""Patterns, stirs and pours as paths: their shape, their speeds, and where they begin and end."""

from importlib.resources import files

import numpy as np
import pytest
from bolfi_liquids.hardware.motion import star
from bolfi_liquids.hardware.motion.pour_paths import (
    RAMP_SECONDS,
    UPRIGHT_RATE,
    approach_pour,
    pour_path,
    ready_to_pour,
    upright_again,
)
from bolfi_liquids.hardware.motion.stir_paths import (
    approach,
    insert,
    joined,
    profile,
    retract,
    stir,
    strokes,
)
from bolfi_liquids.hardware.rig_file import bundled_rig
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from bolfi_liquids import open_recording

RATE = 125.0
RIG = bundled_rig()
CIRCLING = RIG.model_copy(
    update={"stirring": RIG.stirring.model_copy(update={"pattern": "circle"})}
)
POUR = {"angular_velocity": 1.5, "distance": 0.03, "lip_height": 0.2, "final_angle": 2.3}
POURED = pour_path(RIG, **POUR, hold=1.0)


def test_star_is_the_path_that_another_lab_s_solver_recorded():
    recorded = open_recording(files("bolfi_liquids.data") / "glycerin_v10.nc").gripper
    path = star(speed=0.1, height=0.235)
    replayed = np.stack(
        [np.interp(recorded.time, path.time, path.position[:, axis]) for axis in range(2)], axis=1
    )
    apart = np.linalg.norm(replayed - recorded.position[:, :2], axis=1)
    assert np.sqrt(np.mean(apart**2)) < 1e-3
    assert path.time[-1] == pytest.approx(recorded.time[-1], abs=0.1)


@pytest.mark.parametrize("speed", [0.05, 0.5])
def test_a_star_s_speed_and_acceleration_stay_within_their_limits(speed):
    path = star(speed=speed, height=0.2, acceleration=1.5, rate=1000.0)
    velocity = np.diff(path.position, axis=0) * 1000.0
    assert np.linalg.norm(velocity, axis=1).max() < speed * (1 + 1e-6)
    assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() * 1000.0 < 1.5 * 2**0.5 * 1.01


@pytest.mark.parametrize(
    ("argument", "value"),
    [("speed", 0.0), ("radius", float("nan")), ("points", 8), ("points", 1), ("pause", -0.1)],
)
def test_arguments_of_a_star_that_make_no_sense_are_named(argument, value):
    with pytest.raises(ValueError, match=argument):
        star(**{"speed": 0.1, "height": 0.2, argument: value})


PATHS = {
    "approach": approach(RIG, np.array([0.03, -0.02, 0.26, 3.1, 0.05, 0.0])),
    "insert": insert(RIG),
    "stir": stir(RIG, 2),
    "circle": stir(CIRCLING, 2),
    "retract": retract(RIG),
    "approach pour": approach_pour(
        RIG, np.array([-0.3, 0.1, 0.2, 1.5, 0.1, 0.0]), distance=0.03, lip_height=0.2
    ),
    "pour": POURED,
}


@pytest.mark.parametrize("name", PATHS)
def test_every_path_is_bounded_and_goes_from_rest_to_rest(name):
    path = PATHS[name]
    assert path.time == pytest.approx(np.arange(len(path.time)) / RATE)
    velocity = np.diff(path.pose[:, :3], axis=0) * RATE
    assert np.linalg.norm(velocity, axis=1).max() <= 0.1 * (1 + 1e-6)
    change = np.diff(np.concatenate([np.zeros((1, 3)), velocity, np.zeros((1, 3))]), axis=0)
    # a circle's acceleration follows from its speed, and is checked as all are before a motion
    most = RIG.limits.acceleration if name == "circle" else 0.5
    assert np.linalg.norm(change, axis=1).max() * RATE <= most * (1 + 1e-6)


def test_one_cycle_is_the_star_of_the_paper():
    expected, path = star(speed=0.1, height=0.235, acceleration=0.5, rest=2.0, rate=RATE), stir(RIG)
    # strokes last whole periods here: each of the ten may come one period later
    assert 0.0 <= path.duration - expected.time[-1] <= 10.0 / RATE
    apart, _ = cKDTree(expected.position).query(path.pose[:, :3])
    assert apart.max() <= 0.5 * 0.1 / RATE
    assert path.pose[:, 3:] == pytest.approx(np.tile([np.pi, 0, 0], (len(path.time), 1)))
    assert path.stirring


@pytest.mark.parametrize(("points", "pause"), [(2, 0.0), (3, 0.0), (5, 0.4)])
def test_lines_and_pauses_are_stirred_as_they_are_planned(points, pause):
    """Both ways from a plan to a path agree, and the gripper rests as long as it should."""
    settings = {"points": points, "pause": pause, "cycles": 3}
    plan = RIG.stirring.model_copy(update=settings)
    path = stir(RIG.model_copy(update={"stirring": plan}))
    expected = star(speed=0.1, height=0.235, acceleration=0.5, rest=2.0, rate=RATE, **settings)
    count = 3 * points + 1
    assert 0.0 <= path.duration - expected.time[-1] <= count / RATE
    for position in (path.pose[:, :2], expected.position[:, :2]):
        apart, _ = cKDTree(expected.position[:, :2]).query(position)
        assert apart.max() <= 0.5 * 0.1 / RATE
        moved = np.linalg.norm(np.diff(position, axis=0), axis=1)
        still = np.sum(moved < 1e-9) / RATE
        assert still == pytest.approx(2 * 2.0 + (count - 1) * pause, abs=2 * count / RATE)
    if points == 2:
        assert np.abs(expected.position[:, 1]).max() < 1e-15


def test_a_cycle_visits_each_vertex_once_more():
    position = stir(RIG, 3).pose[:, :2]
    at_vertex = np.hypot(*position.T) > 0.0247
    arrivals = np.flatnonzero(at_vertex & ~np.roll(at_vertex, 1))
    angle = np.degrees(np.arctan2(position[arrivals, 1], position[arrivals, 0]))
    assert (np.round(angle / 40.0).astype(int) % 9).tolist() == [4 * k % 9 for k in range(28)]


def test_strokes_continue_each_other_rest_at_vertices_and_join_to_the_whole():
    parts, path = strokes(RIG, 2), stir(RIG, 2)
    assert len(parts) == 1 + 2 * 9
    for before, after in zip(parts, parts[1:], strict=False):
        assert after.pose[0] == pytest.approx(before.pose[-1], abs=1e-12)
    assert joined(parts).pose == pytest.approx(path.pose)
    ends = np.cumsum([stroke.duration for stroke in parts])
    ends[-1] -= RIG.stirring.rest
    at = path.pose[np.rint(ends * RATE).astype(int), :2]
    assert np.hypot(*at.T) == pytest.approx(0.025, abs=1e-12)
    with pytest.raises(ValueError, match="cycles"):
        stir(RIG, 0)


def test_the_way_there_rises_before_it_goes_sideways_and_then_straight_down():
    here = np.array([0.03, -0.02, 0.25, *RIG.robot.stirring_orientation])
    there, down = approach(RIG, here), insert(RIG)
    aside = np.hypot(there.pose[:, 0] - 0.03, there.pose[:, 1] + 0.02) > 1e-9
    assert (there.pose[aside, 2] > 0.32 - 1e-9).all()
    assert there.pose[-1] == pytest.approx(down.pose[0])
    assert np.abs(down.pose[:, :2]).max() < 1e-12
    assert np.diff(down.pose[:, 2]).max() <= 0.0
    assert down.pose[-1, :3] == pytest.approx(stir(RIG).pose[0, :3])
    # from its own goal it stays there
    assert np.ptp(approach(RIG, there.pose[-1]).pose, axis=0).max() < 1e-12


@pytest.mark.parametrize("rig", [RIG, CIRCLING], ids=["star", "circle"])
def test_the_way_back_begins_where_the_stir_ends(rig):
    assert retract(rig).pose[0] == pytest.approx(stir(rig, 2).pose[-1])
    assert retract(rig).pose[-1, :3] == pytest.approx([0.0, 0.0, rig.stirring.clear_height])


def test_a_short_way_is_a_triangle_of_the_given_acceleration():
    way = profile(0.001, 0.1, 0.5)
    assert way.duration == pytest.approx(2 * np.sqrt(0.001 / 0.5))
    travelled = way.travelled(np.array([-1.0, 0.5 * way.duration, 9.0]))
    assert travelled == pytest.approx([0.0, 0.0005, 0.001])


def tilt_of(path):
    """Angle of the source's axis from upright, and its lean towards +x, of each pose."""
    turns = Rotation.from_rotvec(path.pose[:, 3:])
    up = (turns * turns[0].inv()).apply([0.0, 0.0, 1.0])
    return np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2]), up


def test_the_pour_turns_about_the_resting_lip_at_a_constant_rate():
    tilt, up = tilt_of(POURED)
    turning = tilt > 1e-9
    assert np.ptp(POURED.pose[turning, :3], axis=0).max() < 1e-12
    # heading 0: the source leans towards the receiver, along +x, and not aside
    assert up[turning, 0].min() >= 0.0 and np.abs(up[:, 1]).max() < 1e-12
    rate = np.diff(tilt) * RATE
    assert tilt.max() == pytest.approx(2.3)
    steady = np.flatnonzero(rate > 1.5 * (1 - 1e-6))
    assert len(steady) == pytest.approx((2.3 / 1.5 - RAMP_SECONDS) * RATE, abs=2)
    assert rate.max() <= 1.5 * (1 + 1e-6)
    assert -rate.min() <= UPRIGHT_RATE * (1 + 1e-6)
    assert (tilt > 2.3 - 1e-9).sum() / RATE == pytest.approx(1.0, abs=0.05)
    assert POURED.pose[-1] == pytest.approx(POURED.pose[0])


def test_the_lip_is_at_the_asked_distance_and_height():
    lowest = POURED.pose[POURED.pose[:, 2].argmin(), :3] + RIG.cup.position
    assert np.asarray(RIG.pouring.receiver) - lowest == pytest.approx([0.03, 0.0, -0.2])
    assert POURED.pose[0] == pytest.approx(ready_to_pour(RIG, 0.03, 0.2))


def test_a_pour_that_is_given_up_turns_back_the_way_it_came():
    tilt, _ = tilt_of(POURED)
    at = POURED.time[np.flatnonzero(tilt > 1.0)[0]]
    back = upright_again(RIG, POURED, at)
    assert back.pose[0] == pytest.approx(POURED.pose[round(at * RATE)])
    assert np.ptp(back.pose[:, :3], axis=0).max() < 1e-12
    turns = Rotation.from_rotvec(back.pose[:, 3:])
    left = (turns * Rotation.from_rotvec(POURED.pose[0, 3:]).inv()).magnitude()
    assert left[-1] < 1e-9
    assert np.abs(np.diff(left)).max() * RATE <= UPRIGHT_RATE * (1 + 1e-6)
    assert (np.diff(left) <= 1e-12).all()


@pytest.mark.parametrize(
    ("name", "value"), [("angular_velocity", 0.0), ("final_angle", np.nan), ("distance", np.inf)]
)
def test_a_pour_without_sense_is_refused(name, value):
    with pytest.raises(ValueError, match=name):
        pour_path(RIG, **(POUR | {name: value}), hold=0.5)
