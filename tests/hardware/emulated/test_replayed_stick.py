"""Where in its table a replayed stick is; the tables here are drawn up for the tests."""

import numpy as np
import pytest
from bolfi_liquids.hardware import bundled_rig
from bolfi_liquids.hardware.emulated.motion import servoed
from bolfi_liquids.hardware.emulated.stick import (
    FADE,
    NEAR,
    StickMotion,
    advance,
    angles,
    checked,
    init,
)
from bolfi_liquids.hardware.motion import PosePath, joined, star, strokes

DT = 0.008
RATE = 125.0
REST = 1.0  # s
STILL = 1e-3  # rad


def table(path, lean):
    """A stick that leans by `lean` of the time [rad], shape (T, 2), while it goes along a path."""
    return StickMotion(path.time, path.position, lean(path.time))


STAR = star(speed=0.1, height=0.235, acceleration=0.5, rest=REST, rate=RATE)
MOVING = STAR.time[-1] - REST


def swinging(time):
    """Differs at every time of the strokes, and dies away at the end of the last one."""
    swung = np.minimum(time, MOVING - 0.1)
    size = np.clip(time - REST, 0.0, 0.3) * np.exp(-3.0 * (time - swung))
    return size[:, None] * np.column_stack([np.sin(5.0 * swung), np.cos(5.0 * swung)])


STIRRED = table(STAR, swinging)


def at(motion, time):
    return np.column_stack([np.interp(time, motion.time, plane) for plane in motion.inclination.T])


def followed(motion, way, state=None):
    """Phases and angles while the pivot goes along a way, a row a tick; and the last state."""
    state, found = state or init(motion), []
    for pivot in way:
        state = advance(state, pivot, DT)
        found.append((state.phase, *angles(state)))
    return np.array(found), state


def there(motion, time):
    """Where the pivot is at times of the table, shape (T, 3)."""
    return np.column_stack([np.interp(time, motion.time, axis) for axis in motion.pivot.T])


# the stick comes to the path in `FADE`; strokes begin after that
def test_an_arm_on_time_shows_the_table():
    time = np.arange(0.0, STAR.time[-1], DT)
    found, _ = followed(STIRRED, there(STIRRED, time))
    np.testing.assert_allclose(found[:, 0], time + DT, atol=2.0 * DT)
    np.testing.assert_allclose(found[:, 1:], at(STIRRED, found[:, 0]), atol=STILL)


@pytest.mark.parametrize("lag", [0.1, 0.3])
def test_a_stick_follows_the_arm_that_lags_and_not_the_clock(lag):
    time = np.arange(0.0, STAR.time[-1] + lag, DT)
    found, _ = followed(STIRRED, there(STIRRED, time - lag))
    moving = (time - lag > REST + 0.1) & (time - lag < MOVING - 0.05)
    np.testing.assert_allclose(found[moving, 0], time[moving] - lag, atol=0.02)


def test_strokes_that_cross_are_told_apart():
    """The path crosses itself 27 times; a stick that took the nearest point of all would jump."""
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(0.5, 1.5, len(STAR.time)) * DT)
    time = time[time < MOVING]
    way = there(STIRRED, time) + rng.normal(0.0, 2e-4, (len(time), 3))
    found, _ = followed(STIRRED, way)
    moving = time > REST + 0.1
    np.testing.assert_allclose(found[moving, 0], time[moving], atol=0.04)
    assert (np.diff(found[:, 0]) >= 0.0).all()


def test_repeated_cycles_are_gone_through_one_after_the_other():
    time = np.concatenate([STAR.time, STAR.time[-1] + DT + STAR.time])
    twice = StickMotion(time, np.tile(STAR.position, (2, 1)), np.column_stack([time, -time]) * 1e-2)
    found, _ = followed(twice, twice.pivot)
    np.testing.assert_allclose(found[:, 0], time, atol=0.04)


def trailing(path):
    """A stick that trails behind its pivot and takes 0.4 s to do so, whatever the direction."""
    velocity = np.diff(path.position[:, :2], axis=0, prepend=path.position[:1, :2]) * RATE
    lean = np.zeros_like(velocity)
    for at in range(1, len(lean)):
        lean[at] = lean[at - 1] - DT / 0.4 * (lean[at - 1] + 3.0 * velocity[at])
    return StickMotion(path.time, path.position, lean)


@pytest.mark.parametrize("strokes_made", [4, 13])
def test_a_stick_that_is_stopped_at_a_stroke_s_end_relaxes_as_if_it_had_been_planned(strokes_made):
    """Nothing of that rest is in the table, whose only rest at a stroke's end is its last one."""
    rig = bundled_rig()
    plan = strokes(rig, 2)
    whole, ended = trailing(servoed(joined(plan))), joined(plan[:strokes_made])
    rest = np.tile(ended.pose[-1], (250, 1))
    stopped = trailing(servoed(joined([ended, PosePath(np.arange(250) * DT, rest, True)])))
    found, _ = followed(whole, stopped.pivot)
    resting = stopped.time > ended.duration
    size = np.linalg.norm(stopped.inclination[resting], axis=1).max()
    assert size > 0.1
    error = found[resting, 1:] - stopped.inclination[resting]
    assert np.abs(error).max() < 0.05 * size


def test_after_a_pause_it_goes_on_and_nowhere_jumps():
    stop = REST + 2.175  # in the middle of a stroke
    time = np.arange(0.0, stop, DT)
    found, state = followed(STIRRED, there(STIRRED, time))
    waiting, state = followed(STIRRED, np.tile(there(STIRRED, [stop]), (62, 1)), state)
    assert state.phase == pytest.approx(stop, abs=0.01)
    assert np.linalg.norm(waiting[-1, 1:]) < 0.5 * np.linalg.norm(found[-1, 1:])
    since = np.arange(stop, MOVING, DT)
    again, _ = followed(STIRRED, there(STIRRED, since), state)
    later = since > stop + 0.3
    np.testing.assert_allclose(again[later, 1:], at(STIRRED, since + DT)[later], atol=0.02)
    assert np.abs(np.diff(np.vstack([found, waiting, again])[:, 1:], axis=0)).max() < 0.05


def test_before_and_after_the_stir_it_hangs_straight_down_and_a_second_stir_is_like_the_first():
    above = STAR.position[0] + np.outer(np.linspace(0.085, 0.0, 212), [0.0, 0.0, 1.0])
    out = there(STIRRED, STAR.time[-1:]) + above[::-1] - STAR.position[0]
    hung = np.tile(out[-1], (round(FADE / DT) + 1, 1))
    way = np.concatenate([above, there(STIRRED, STAR.time), out, hung])
    found, state = followed(STIRRED, way)
    assert (found[: 212 - round(NEAR / 4e-4), 1:] == 0.0).all()
    assert (found[-1, 1:] == 0.0).all()
    assert state == init(STIRRED)
    again, _ = followed(STIRRED, way, state)
    np.testing.assert_array_equal(again, found)


def test_a_table_that_is_none_is_named():
    for wrong in (
        {"time": STAR.time[::-1]},
        {"pivot": STAR.position[1:]},
        {"inclination": np.full((len(STAR.time), 2), np.nan)},
        {part: getattr(STIRRED, part)[:1] for part in StickMotion._fields},
    ):
        with pytest.raises(ValueError, match="stick's motion"):
            checked(STIRRED._replace(**wrong))
