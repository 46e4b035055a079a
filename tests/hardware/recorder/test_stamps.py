"""Stamps that are no times are seen, at any time of a recording; usual ones are let pass."""

import numpy as np
import pytest
from bolfi_liquids.hardware.recorder.stamps import (
    MAX_APART,
    MAX_BAD_STAMPS,
    StampWatch,
    judged_stamps,
)

RATE = 30.0
FAULT = 300  # frame


def arrivals(rng, count=900):
    """Index, stamp and time of arrival of a camera whose clock drifts."""
    host = 5000.0 + np.arange(count) / RATE
    stamp = 1000.0 + (host - host[0]) * (1.0 + 5e-5)
    return np.arange(count), stamp, host + 0.03 + 0.01 * rng.random(count)


@pytest.fixture
def rng():
    return np.random.default_rng(4)


def changed(stamp, kind):
    """What becomes of the stamps after `FAULT`."""
    elapsed = stamp - stamp[FAULT]
    return {
        "unit": 1e3 * stamp,
        "smaller unit": 1e-3 * stamp,
        "stand": np.full(len(stamp), stamp[FAULT - 1]),
        "back": stamp[FAULT - 1] - elapsed,
        "zero": np.zeros(len(stamp)),
        "ahead": stamp + 2 * MAX_APART,
        "behind": stamp - 2 * MAX_APART,
        "faster": stamp + elapsed,
        "nan": np.full(len(stamp), np.nan),
    }[kind]


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("unit", "unit"),
        ("smaller unit", "stand still"),  # a thousandth of a second is none
        ("stand", "stand still"),
        ("back", "backwards"),
        ("zero", "stand still"),
        ("ahead", "jump by +1.00 s"),
        ("behind", "jump by -1.00 s"),
        ("faster", "2 times"),
        ("nan", "no numbers"),
    ],
)
def test_a_clock_that_is_lost_is_named_with_frame_and_time(rng, kind, told):
    index, stamp, host = arrivals(rng)
    stamp[FAULT:] = changed(stamp, kind)[FAULT:]
    judged = judged_stamps(index, stamp, host)
    assert told in judged.fault
    # a clock that runs away is let pass until it is too far apart
    first = FAULT + (int(MAX_APART * RATE) + 2 if kind == "faster" else 1)
    assert judged.good[:FAULT].all() and not judged.good[first:].any()
    named = int(judged.fault.split("frame ")[1].split()[0])
    assert FAULT <= named <= first
    assert f"({named / RATE:.1f} s)" in judged.fault


def test_what_a_usual_computer_does_is_let_pass(rng):
    index, stamp, host = arrivals(rng, 18_000)
    for start in (200, 5000, 12_000):  # it falls behind, and takes what the driver has kept
        host[start : start + 12] = np.maximum(host[start : start + 12], host[start] + 0.4)
    judged = judged_stamps(index, stamp, host)
    assert (judged.left_out, judged.fault) == (0, "")


def test_odd_stamps_cost_their_own_frames_only(rng):
    index, stamp, host = arrivals(rng)
    stamp[400], stamp[500], stamp[600] = stamp[399], stamp[498], 1e9
    stamp[700 : 700 + MAX_BAD_STAMPS] = np.nan
    judged = judged_stamps(index, stamp, host)
    odd = [400, 500, 600, *range(700, 700 + MAX_BAD_STAMPS)]
    assert np.flatnonzero(~judged.good).tolist() == odd
    assert judged.fault == ""


def test_a_watch_concludes_once_and_for_all(rng):
    index, stamp, host = arrivals(rng)
    watch = StampWatch()
    stood = np.where(index < FAULT, stamp, stamp[FAULT])
    for row in zip(index[:400], stood[:400], host[:400], strict=True):
        watch.take(*row)
    fault = watch.fault
    assert fault is not None
    watch.take(400, stamp[400], host[400])
    assert watch.fault == fault and 400 in watch.left_out


def test_no_frames_have_no_fault():
    nothing = np.empty(0)
    assert judged_stamps(nothing, nothing, nothing).fault == ""


WRONG_FIRST = {
    "far ahead": lambda stamp: stamp + 1e9,
    "zero": lambda stamp: 0.0 * stamp,
    "behind": lambda stamp: stamp - 3.0,
    "ahead": lambda stamp: stamp + 3.0,
    "a little ahead": lambda stamp: stamp + 0.4,
    "nan": lambda stamp: np.nan * stamp,
    "another unit": lambda stamp: 1e3 * stamp,
    "garbage": lambda stamp: np.random.default_rng(7).uniform(-1e6, 1e6, len(stamp)),
}


@pytest.mark.parametrize("count", [1, 2, 5])
@pytest.mark.parametrize("kind", WRONG_FIRST)
def test_wrong_first_stamps_cost_their_own_frames_only(rng, kind, count):
    index, stamp, host = arrivals(rng)
    stamp[:count] = WRONG_FIRST[kind](stamp[:count])
    judged = judged_stamps(index, stamp, host)
    assert judged.fault == ""
    assert np.flatnonzero(~judged.good).tolist() == list(range(count))


@pytest.mark.parametrize("at", [0, 1, 3, 20, 400])
@pytest.mark.parametrize("ahead", [0.1, 0.2, 0.45])  # of one frame alone either may be wrong
def test_a_stamp_that_is_a_little_ahead_condemns_none_of_those_that_it_overtakes(rng, at, ahead):
    index, stamp, host = arrivals(rng)
    stamp[at] += ahead
    judged = judged_stamps(index, stamp, host)
    assert (np.flatnonzero(~judged.good).tolist(), judged.fault) == ([at], "")


@pytest.mark.parametrize("kind", ["unit", "stand", "back", "zero", "nan"])
@pytest.mark.parametrize("start", [1, 4, 15])
def test_a_clock_that_is_lost_at_its_start_is_lost(rng, kind, start):
    index, stamp, host = arrivals(rng)
    elapsed = stamp - stamp[start]
    lost = {
        "unit": 1e3 * stamp,
        "stand": np.full(len(stamp), stamp[start - 1]),
        "back": stamp[start - 1] - elapsed,
        "zero": np.zeros(len(stamp)),
        "nan": np.full(len(stamp), np.nan),
    }[kind]
    stamp[start:] = lost[start:]
    judged = judged_stamps(index, stamp, host)
    assert judged.fault and not judged.good[start + MAX_BAD_STAMPS :].any()
