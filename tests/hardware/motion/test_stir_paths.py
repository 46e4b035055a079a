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

RATE = 125.0
POUR = {"angular_velocity": 1.5, "distance": 0.03, "lip_height": 0.2, "final_angle": 2.3}


@pytest.fixture(scope="module")
def rig():
    return bundled_rig()


def circling(rig):
    plan = rig.stirring.model_copy(update={"pattern": "circle"})
    return rig.model_copy(update={"stirring": plan})


def all_paths(rig):
    here = np.array([0.03, -0.02, 0.26, 3.1, 0.05, 0.0])
    return {
        "approach": approach(rig, here),
        "insert": insert(rig),
        "stir": stir(rig),
        "stir twice": stir(rig, 2),
        "stir four times": stir(rig, 4),
        "circle": stir(circling(rig), 2),
        "retract": retract(rig),
        "approach pour": approach_pour(
            rig, np.array([-0.3, 0.1, 0.2, 1.5, 0.1, 0.0]), distance=0.03, lip_height=0.2
        ),
        "pour": pour_path(rig, **POUR, hold=1.0),
    }


@pytest.mark.parametrize("name", list(all_paths(bundled_rig())))
def test_every_path_is_bounded_and_goes_from_rest_to_rest(rig, name):
    path = all_paths(rig)[name]
    assert path.time == pytest.approx(np.arange(len(path.time)) / RATE)
    velocity = np.diff(path.pose[:, :3], axis=0) * RATE
    assert np.linalg.norm(velocity, axis=1).max() <= 0.1 * (1 + 1e-6)
    change = np.diff(np.concatenate([np.zeros((1, 3)), velocity, np.zeros((1, 3))]), axis=0)
    # a circle's acceleration follows from its speed, and is checked as all are before a motion
    most = rig.limits.acceleration if name == "circle" else 0.5
    assert np.linalg.norm(change, axis=1).max() * RATE <= most * (1 + 1e-6)


def test_one_cycle_is_the_star_of_the_paper(rig):
    expected = star(speed=0.1, height=0.235, acceleration=0.5, rest=2.0, rate=RATE)
    path = stir(rig)
    # strokes last whole periods here: each of the ten may come one period later
    assert 0.0 <= path.duration - expected.time[-1] <= 10.0 / RATE
    apart, _ = cKDTree(expected.position).query(path.pose[:, :3])
    assert apart.max() <= 0.5 * 0.1 / RATE
    assert path.pose[:, 3:] == pytest.approx(np.tile([np.pi, 0, 0], (len(path.time), 1)))
    assert path.stirring


@pytest.mark.parametrize("cycles", [1, 2, 3])
def test_a_cycle_visits_each_vertex_once_more(rig, cycles):
    position = stir(rig, cycles).pose[:, :2]
    at_vertex = np.hypot(*position.T) > 0.0247
    arrivals = np.flatnonzero(at_vertex & ~np.roll(at_vertex, 1))
    angle = np.degrees(np.arctan2(position[arrivals, 1], position[arrivals, 0]))
    vertex = np.round(angle / 40.0).astype(int) % 9
    assert vertex.tolist() == [4 * k % 9 for k in range(9 * cycles + 1)]


def test_strokes_continue_each_other_and_join_to_the_whole(rig):
    parts = strokes(rig, 3)
    assert len(parts) == 1 + 3 * 9
    for before, after in zip(parts, parts[1:], strict=False):
        assert after.pose[0] == pytest.approx(before.pose[-1], abs=1e-12)
    assert joined(parts).pose == pytest.approx(stir(rig, 3).pose)
    with pytest.raises(ValueError, match="0 is not from 1 to"):
        stir(rig, 0)


def test_strokes_end_where_the_tool_rests(rig):
    path = stir(rig, 2)
    ends = np.cumsum([stroke.duration for stroke in strokes(rig, 2)])
    ends[-1] -= rig.stirring.rest
    assert len(ends) == 19
    at = path.pose[np.rint(ends * RATE).astype(int), :2]
    assert np.hypot(*at.T) == pytest.approx(0.025, abs=1e-12)
    assert np.diff(ends)[1:] == pytest.approx(ends[2] - ends[1])


def test_the_way_there_rises_before_it_goes_sideways_and_then_straight_down(rig):
    here = np.array([0.03, -0.02, 0.25, *rig.robot.stirring_orientation])
    there, down = approach(rig, here), insert(rig)
    aside = np.hypot(there.pose[:, 0] - 0.03, there.pose[:, 1] + 0.02) > 1e-9
    assert (there.pose[aside, 2] > 0.32 - 1e-9).all()
    assert there.pose[-1] == pytest.approx(down.pose[0])
    assert np.abs(down.pose[:, :2]).max() < 1e-12
    assert np.diff(down.pose[:, 2]).max() <= 0.0
    assert down.pose[-1, :3] == pytest.approx(stir(rig).pose[0, :3])


@pytest.mark.parametrize("make", [lambda rig: rig, circling])
def test_the_way_back_begins_where_the_stir_ends(rig, make):
    rig = make(rig)
    assert retract(rig).pose[0] == pytest.approx(stir(rig, 2).pose[-1])
    assert retract(rig).pose[-1, :3] == pytest.approx([0.0, 0.0, rig.stirring.clear_height])


def test_an_approach_from_its_own_goal_stays_there(rig):
    path = approach(rig, approach(rig, np.array([0, 0, 0.32, np.pi, 0, 0])).pose[-1])
    assert np.ptp(path.pose, axis=0).max() < 1e-12


def test_a_short_way_is_a_triangle_of_the_given_acceleration():
    way = profile(0.001, 0.1, 0.5)
    assert way.duration == pytest.approx(2 * np.sqrt(0.001 / 0.5))
    assert way.travelled(np.array([-1.0, 0.5 * way.duration, 9.0])) == pytest.approx(
        [0.0, 0.0005, 0.001]
    )


def tilt_of(path):
    """Angle of the source's axis from upright, and its lean towards +x, of each pose."""
    turns = Rotation.from_rotvec(path.pose[:, 3:])
    up = (turns * turns[0].inv()).apply([0.0, 0.0, 1.0])
    return np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2]), up


def test_the_pour_turns_about_the_resting_lip_at_a_constant_rate(rig):
    path = pour_path(rig, **POUR, hold=1.0)
    tilt, up = tilt_of(path)
    turning = tilt > 1e-9
    assert np.ptp(path.pose[turning, :3], axis=0).max() < 1e-12
    # heading 0: the source leans towards the receiver, along +x, and not aside
    assert up[turning, 0].min() >= 0.0 and np.abs(up[:, 1]).max() < 1e-12
    rate = np.diff(tilt) * RATE
    assert tilt.max() == pytest.approx(2.3)
    steady = np.flatnonzero(rate > 1.5 * (1 - 1e-6))
    assert len(steady) == pytest.approx((2.3 / 1.5 - RAMP_SECONDS) * RATE, abs=2)
    assert rate.max() <= 1.5 * (1 + 1e-6)
    assert -rate.min() <= UPRIGHT_RATE * (1 + 1e-6)
    assert (tilt > 2.3 - 1e-9).sum() / RATE == pytest.approx(1.0, abs=0.05)
    assert path.pose[-1] == pytest.approx(path.pose[0])


def test_the_lip_is_at_the_asked_distance_and_height(rig):
    path = pour_path(rig, **POUR, hold=0.5)
    lowest = path.pose[path.pose[:, 2].argmin(), :3] + rig.cup.position
    assert np.asarray(rig.pouring.receiver) - lowest == pytest.approx([0.03, 0.0, -0.2])
    assert path.pose[0] == pytest.approx(ready_to_pour(rig, 0.03, 0.2))


def test_a_pour_that_is_given_up_turns_back_the_way_it_came(rig):
    path = pour_path(rig, **POUR, hold=1.0)
    tilt, _ = tilt_of(path)
    at = path.time[np.flatnonzero(tilt > 1.0)[0]]
    back = upright_again(rig, path, at)
    assert back.pose[0] == pytest.approx(path.pose[round(at * RATE)])
    assert np.ptp(back.pose[:, :3], axis=0).max() < 1e-12
    turns = Rotation.from_rotvec(back.pose[:, 3:])
    left = (turns * Rotation.from_rotvec(path.pose[0, 3:]).inv()).magnitude()
    assert left[-1] < 1e-9
    assert np.abs(np.diff(left)).max() * RATE <= UPRIGHT_RATE * (1 + 1e-6)
    assert (np.diff(left) <= 1e-12).all()


@pytest.mark.parametrize(
    ("name", "value"), [("angular_velocity", 0.0), ("final_angle", np.nan), ("distance", np.inf)]
)
def test_a_pour_without_sense_is_refused(rig, name, value):
    with pytest.raises(ValueError, match=name):
        pour_path(rig, **(POUR | {name: value}), hold=0.5)
