"""Data so far are brought onto the plan's times, or refused."""

import numpy as np
import pytest
from bolfi_liquids.hardware.motion import star

from bolfi_liquids.inputs.recording import planned_recording
from bolfi_liquids.online.plan import (
    MAX_DELAY_CHANGE,
    MAX_OFF_PLAN,
    PartialRecording,
    align,
    stroke_ends,
)

ATTRS = {"liquid_density": 1000.0}
PATH = star(speed=0.1, height=0.235)
PLAN = planned_recording(PATH.time, PATH.position, ATTRS)
ENDS = stroke_ends(PLAN)


def inclination(time):
    """A smooth signal in each plane."""
    return np.stack([0.1 * np.sin(3.0 * time), 0.05 * np.cos(2.0 * time)], axis=1)


def data(until, *, delay=0.0, off=0.0, rate=125.0):
    """An arm that does what the plan said `delay` before, `off` metres higher; seen at `rate`."""
    time = np.arange(0.0, until, 1.0 / rate)
    position = np.column_stack([np.interp(time - delay, PLAN.time, x) for x in PATH.position.T])
    return PartialRecording(time, position + [0.0, 0.0, off], inclination(time - delay), 0.0)


def test_strokes_of_a_star_end_where_it_turns():
    # to the first vertex, then from vertex to vertex: at each the gripper is near the circle,
    # but for the time in which it speeds up or slows down, 5 mm to each side
    at = np.stack([np.interp(ENDS, PLAN.time, x) for x in PATH.position.T[:2]])
    assert len(ENDS) == 10
    np.testing.assert_allclose(np.hypot(*at), 0.025, atol=5e-3)


def test_data_are_those_of_the_plan_up_to_the_last_finished_stroke():
    delay = 0.032
    aligned = align(PLAN, ENDS, data(ENDS[3] + 0.2, delay=delay))
    assert (aligned.strokes, aligned.covered, aligned.refusal) == (4, ENDS[3], "")
    assert aligned.delay == pytest.approx(delay, abs=1e-3)
    assert aligned.apart < 2e-4
    truth = inclination(PLAN.time)
    inside = (PLAN.time <= ENDS[3]) & (PLAN.time > 0.05)
    # half a millisecond of delay, and what lies between samples
    np.testing.assert_allclose(aligned.observed[inside], truth[inside], atol=3e-4)
    assert np.isnan(aligned.observed[PLAN.time > ENDS[3] + 1e-3]).all()


def test_an_arm_that_gets_later_and_later_is_followed():
    """As one whose loop misses a period now and then."""
    late = 0.04
    assert late * ENDS[8] > MAX_DELAY_CHANGE
    seen = data(ENDS[8] + late * ENDS[8] + 0.2)
    time = seen.time / (1.0 + late)
    position = np.column_stack([np.interp(time, PLAN.time, x) for x in PATH.position.T])
    aligned = align(PLAN, ENDS, PartialRecording(seen.time, position, inclination(time), 0.0))
    assert (aligned.strokes, aligned.refusal) == (9, "")
    assert aligned.delay == pytest.approx(late * ENDS[8], abs=0.02)
    inside = (PLAN.time <= ENDS[8]) & (PLAN.time > 0.05)
    # within a stroke the delay changes by some 25 ms, and the signal by 0.3 rad/s
    apart = aligned.observed[inside] - inclination(PLAN.time)[inside]
    assert np.abs(apart).max() < 0.3 * 0.025


def test_a_pause_at_a_corner_is_followed_from_its_first_sample_on():
    near = np.abs(PLAN.time - ENDS[2]) < 0.15
    corner = PLAN.time[near][np.hypot(*PATH.position[near, :2].T).argmax()]
    refused = {}
    for until in np.arange(ENDS[2] - 0.1, ENDS[3] + 0.1, 0.04):
        seen = data(until)
        time = seen.time - np.clip(seen.time - corner, 0.0, 0.05)
        position = np.column_stack([np.interp(time, PLAN.time, x) for x in PATH.position.T])
        refused[until] = align(PLAN, ENDS, seen._replace(position=position)).refusal
    assert not any(refused.values()), refused


def test_no_sample_falls_between_two_strokes():
    delay = 0.1
    seen = data(ENDS[2], delay=delay)
    away = (seen.time > ENDS[0]) & (seen.time < ENDS[0] + delay)
    seen.position[away, 2] += 2.0 * MAX_OFF_PLAN
    assert "mm off its plan" in align(PLAN, ENDS, seen).refusal


def test_a_recording_of_the_plan_itself_is_left_as_it_is():
    same = PartialRecording(PLAN.time, PATH.position, inclination(PLAN.time), 0.0)
    aligned = align(PLAN, ENDS, same)
    until = PLAN.time <= ENDS[-1]
    np.testing.assert_array_equal(aligned.observed[until], inclination(PLAN.time)[until])
    assert aligned.delay == 0.0


def test_before_the_first_stroke_ends_there_is_nothing():
    aligned = align(PLAN, ENDS, data(ENDS[0] - 0.1))
    assert aligned.strokes == 0 and np.isnan(aligned.observed).all()


def test_what_the_cameras_missed_is_missing():
    seen = data(ENDS[5] + 0.1)
    blind = (seen.time > 1.0) & (seen.time < 1.5)
    seen.inclination[blind, 1] = np.nan
    aligned = align(PLAN, ENDS, seen)
    missing = np.isnan(aligned.observed) & (PLAN.time <= ENDS[5])[:, None]
    missing[0] = False
    assert not missing[:, 0].any()
    wanted = (PLAN.time > 1.0) & (PLAN.time < 1.48)
    np.testing.assert_array_equal(missing[1:, 1] & wanted[1:], wanted[1:])
    assert missing[:, 1].sum() <= wanted.sum() + 2


def test_another_stir_is_refused_and_tracking_errors_are_not():
    rows = (
        (data(ENDS[2] + 0.1, off=2.4e-3), "mm off its plan"),
        (data(ENDS[2] + 0.1, off=1.6e-3), ""),
        (data(ENDS[2] + 0.1, delay=0.24), "lost 240 ms"),
        (data(ENDS[2] + 0.1, delay=-0.24), "gained 240 ms"),
        (data(ENDS[2] + 0.1, delay=0.16), ""),
        (data(2.0)._replace(position=np.full((250, 3), np.nan)), "positions"),
    )
    for seen, why in rows:
        refusal = align(PLAN, ENDS, seen).refusal
        assert why in refusal and bool(why) == bool(refusal), why


def test_what_is_no_recording_is_refused():
    seen = data(2.0)
    none = PartialRecording(*(of[:0] for of in seen[:3]), 0.0)
    twice, missing = seen.time.copy(), seen.time.copy()
    twice[100], missing[100] = twice[99], np.nan
    rows = (
        (none, "positions"),
        (seen._replace(time=twice), "do not increase"),
        (seen._replace(time=seen.time[::-1]), "do not increase"),
        (seen._replace(time=missing), "do not increase"),
        (seen._replace(time=seen.time[:-1]), "shapes"),
        (seen._replace(position=seen.position[:, :2]), "shapes"),
        (seen._replace(inclination=seen.inclination[:, 0]), "shapes"),
    )
    for odd, why in rows:
        aligned = align(PLAN, ENDS, odd)
        assert why in aligned.refusal and aligned.strokes == 0
        assert np.isnan(aligned.observed).all()
