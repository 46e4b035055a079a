"""Camera clocks that fail in the middle of a stir: the recording ends there, and says why."""

import numpy as np
import pytest
from bolfi_liquids.hardware.recorder.clock_steps import MIN_UNEVENNESS, unevenness, without_steps
from bolfi_liquids.hardware.recorder.finalise import finalise
from bolfi_liquids.hardware.recorder.raw import read_raw
from bolfi_liquids.hardware.recorder.stir import extract_stir
from closed_form_session import WAY, inclination

import bolfi_liquids as bl

FAULT = 250  # frame of a stir of 12 s, in its middle


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda frame: frame._replace(stamp=1e3 * frame.stamp), "unit"),
        (lambda frame: frame._replace(stamp=frame.stamp + 2.0), "jump by"),
        (lambda frame: frame._replace(stamp=7.0), "stand still"),
    ],
    ids=["unit", "jump", "stand"],
)
@pytest.mark.parametrize("view", ["xz", "yz"])
def test_a_camera_whose_stamps_fail_ends_the_recording_and_is_named(session, view, change, told):
    def fail(_, frames):
        frames[view][FAULT:] = map(change, frames[view][FAULT:])

    recording = bl.open_recording(finalise(session(change=fail)))
    assert recording.time[-1] == pytest.approx(FAULT / 30 - WAY, abs=0.1)
    reason = recording.attrs["reason"]
    assert recording.attrs["status"] == "aborted"
    assert f"view {view}" in reason and told in reason and f"frame {FAULT}" in reason
    assert recording.attrs[f"camera_{view}_bad_stamps"] == 12 * 30 + 2 * WAY * 30 - FAULT
    apart = recording.inclination - inclination(WAY + recording.time)
    assert np.degrees(np.nanmax(np.abs(apart))) < 0.15


@pytest.mark.parametrize("step", [0.1, -0.1, 0.4])
def test_a_step_that_only_the_marker_shows_ends_the_recording(session, step):
    def jump(_, frames):
        later = [f._replace(stamp=f.stamp + step) for f in frames["yz"][FAULT:]]
        frames["yz"][FAULT:] = later

    recording = bl.open_recording(finalise(session(change=jump)))
    assert recording.time[-1] <= FAULT / 30 - WAY + 0.1
    assert recording.attrs["status"] == "aborted"
    assert "view yz: its stamps jump by" in recording.attrs["reason"]
    apart = recording.inclination - inclination(WAY + recording.time)
    assert np.degrees(np.nanmax(np.abs(apart))) < 0.15


def test_odd_stamps_are_left_out_and_counted(session):
    def odd(_, frames):
        for k in (100, 180, 181, 300):
            frames["xz"][k] = frames["xz"][k]._replace(stamp=1e6)

    recording = bl.open_recording(finalise(session(change=odd)))
    assert recording.attrs["status"] == "complete"
    assert recording.attrs["camera_xz_bad_stamps"] == 4
    assert recording.attrs["camera_yz_bad_stamps"] == 0
    apart = recording.inclination - inclination(WAY + recording.time)
    assert np.degrees(np.nanmax(np.abs(apart))) < 0.2


@pytest.mark.parametrize("stamp", [1e9, 0.0, float("nan")])
def test_a_wrong_first_stamp_costs_its_own_frame_only(session, stamp):
    def wrong(_, frames):
        frames["xz"][0] = frames["xz"][0]._replace(stamp=stamp)

    recording = bl.open_recording(finalise(session(change=wrong)))
    assert recording.attrs["status"] == "complete"
    assert recording.attrs["camera_xz_bad_stamps"] == 1


def test_a_clock_without_a_step_is_fitted_once(session):
    raw = read_raw(session())
    same, clocks = without_steps(raw, "here")
    assert same.frames == raw.frames and set(clocks) == {"xz", "yz"}
    for view, clock in extract_stir(raw, "here").clocks.items():
        assert clocks[view] == clock
    assert extract_stir(raw, "here", clocks=clocks).clocks == clocks


@pytest.mark.parametrize(
    ("turns", "tells"), [((), False), ((3.9,), False), ((2.0,), True), ((1.0, 2.0, 3.0), True)]
)
def test_only_a_change_of_velocity_tells_a_clock(turns, tells):
    """A slow straight stroke fits any clock; one that turns back fits its own."""
    stamp = np.arange(0.0, 4.0, 1 / 30)
    velocity = 16.0 * (-1.0) ** np.searchsorted(np.array(turns), stamp)
    marker = np.stack([np.cumsum(velocity) / 30, np.zeros(len(stamp))], axis=1)
    marker += np.random.default_rng(0).normal(0.0, 0.05, marker.shape)
    marker[::20] = np.nan
    assert (unevenness(stamp, marker) > MIN_UNEVENNESS) == tells
    assert unevenness(stamp, np.full_like(marker, np.nan)) == 0.0
